#pragma once
// Records that Python fills in by the names of their members.
#include <tuple>

/// Names the members of a record, last in it.
#define CATENARY_RECORD(...)                              \
    static constexpr const char* kMembers = #__VA_ARGS__; \
    auto members() {                                      \
        return std::tie(__VA_ARGS__);                     \
    }

/// Shapes that arrays from Python must have, member by member, in the words of python/shapes.hpp.
#define CATENARY_SHAPES(shapes) static constexpr const char* kShapes = shapes;

namespace catenary {

template <class T>
concept RecordType = requires(T record) {
    T::kMembers;
    record.members();
};

}  // namespace catenary
