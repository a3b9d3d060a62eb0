#pragma once
// Parts of free steps as Python gives them: layouts apart.
#include "motion/two_passes.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

inline PassParts pass_parts(const std::vector<Layout>& rows, const std::vector<Layout>& factors,
                            const py::object& parts, Kept& kept) {
    auto convert = [&]<class Record>(const char* name, Record& record) {
        record = From<Record>::convert(parts.attr(name), name, kept);
    };
    PassParts found;
    for (size_t k = 0; k < rows.size(); ++k) found.layouts.emplace_back(rows[k], factors.at(k));
    convert("station_types", found.station_types);
    convert("rows", found.rows);
    convert("factors", found.factors);
    convert("arrays", found.arrays);
    convert("changes", found.changes);
    return found;
}

}  // namespace catenary::python
