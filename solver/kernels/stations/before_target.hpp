#pragma once
// Headers that are the same for all targets: their functions must not be built for one of them.
#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include "stations/known_layouts.hpp"
#include "stations/line.hpp"
