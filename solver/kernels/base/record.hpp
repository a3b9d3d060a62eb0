#pragma once
// Records that Python fills in by the names of their members.
#include <tuple>

/// Names the members of a record, last in it.
#define CATENARY_RECORD(...)                              \
    static constexpr const char* kMembers = #__VA_ARGS__; \
    auto members() {                                      \
        return std::tie(__VA_ARGS__);                     \
    }
