// Python bindings of lines whose unknowns stand in stations.
#include <algorithm>
#include <stdexcept>
#include <string>

#include "motion/two_passes.hpp"
#include "python/from_python.hpp"
#include "stations/elimination.hpp"
#include "stations/known_layouts.hpp"

namespace catenary::python {

namespace {

using Joined = py::array_t<bool, py::array::c_style | py::array::forcecast>;

Layout layout_of(const Joined& own, const Joined& beside, bool damped, bool factors) {
    const py::ssize_t n = own.ndim() == 2 ? own.shape(0) : 0;
    for (const Joined& joined : {own, beside})
        if (joined.ndim() != 2 || joined.shape(0) != n || joined.shape(1) != n)
            throw py::value_error("own and beside must be square arrays of one size");
    if (n < 1 || n > kMostUnknowns)
        throw py::value_error("a station has 1 to " + std::to_string(kMostUnknowns) + " unknowns");
    const Pieces pieces{static_cast<int>(n)};
    auto mask = [&pieces](const Joined& joined) {
        return mask_of(pieces, [&joined](int i, int j) { return joined.at(i, j); });
    };
    return fitting({pieces.unknowns, mask(own), mask(beside), damped, factors});
}

/// Row and column of each number of a packed block, (2, n), -1 where it is of none.
py::array_t<int64_t> places(const Layout& layout, const std::string& which) {
    const Mask mask = which == "own"      ? layout.own
                      : which == "beside" ? layout.beside
                      : which == "half"   ? upper(layout.own)
                                          : throw py::key_error(which);
    py::array_t<int64_t> found({2, layout.size_of(mask)});
    auto at = found.mutable_unchecked<2>();
    py::ssize_t n = 0;
    each_number(layout.pieces(), mask, [&](const Joint& joint, int, int, int) {
        at(0, n) = joint.row;
        at(1, n++) = joint.column;
    });
    return found;
}

/// Whether kernels were compiled for stations of such rows and factors, on the newer processors.
bool are_compiled(const Layout& rows, const Layout& factors) {
    return std::ranges::any_of(
        kShipped, [&](const Shipped& one) { return one.rows == rows && one.factors == factors; });
}

using Layouts = std::vector<Layout>;
using MakeUps = std::vector<std::vector<int>>;

/// A line with kernels for the first station types, which have layouts.
Line line_of(const Layouts& layouts, const MakeUps& station_types,
             std::unique_ptr<Kernels> (*kernels_for)(const Layout&)) {
    std::vector<std::unique_ptr<Kernels>> kernels;
    for (const Layout& layout : layouts) kernels.push_back(kernels_for(layout));
    return Line(std::move(kernels), station_types);
}

/// Products with rows of K, and -C.
class Products {
  public:
    Products(const Layouts& layouts, const MakeUps& station_types, const py::object& rows)
        : line_(line_of(layouts, station_types, kernels_of_rows)),
          rows_(From<ProductArrays>::convert(rows, "rows", kept_)) {
        work_.product = rows_.product(layouts);
        // Stations of the result stand as the stations of the operand.
        const int64_t n = size(rows_.kinds), first = rows_.first;
        if (!rows_.sections.starts.empty()) {
            const auto starts = rows_.sections.starts.subspan(first, n);
            starts_.assign(starts.begin(), starts.end());
            for (auto& start : starts_) start -= starts[0];
            work_.factored.places = {starts_, part(rows_.sections.station_type, first, first + n)};
        }
        line_.set_runs(work_, n, 0);
    }
    void multiply(int64_t begin, int64_t end, const py::object& factor, const py::object& velocity,
                  const py::object& result) {
        part(rows_.kinds, begin, end);
        work_.product.factor = numbers<const double>(factor, "factor", line_.n_read()).data();
        work_.product.velocity = numbers<const double>(velocity, "velocity", line_.n_read()).data();
        line_.multiply(work_, begin, end,
                       numbers<double>(result, "result", line_.n_solved()).data());
    }

  private:
    Kept kept_;
    Line line_;
    ProductArrays rows_;
    Work work_;
    std::vector<int64_t> starts_;
};

/// Solves with factors.
class Solves {
  public:
    Solves(const Layouts& layouts, const MakeUps& station_types, const py::object& factors)
        : line_(line_of(layouts, station_types, kernels_of_factors)),
          factors_(From<FactorArrays>::convert(factors, "factors", kept_)) {
        work_.factored = factors_.factored(layouts);
        line_.set_runs(work_, size(factors_.kinds), 0);
    }
    void solve(const py::object& right, const py::object& answer) {
        work_.right = numbers<const double>(right, "right", line_.n_solved()).data();
        work_.answer = numbers<double>(answer, "answer", line_.n_solved()).data();
        line_.solve(work_, size(factors_.kinds), factors_.at().middle);
    }

  private:
    Kept kept_;
    Line line_;
    FactorArrays factors_;
    Work work_;
};

/// An array of numbers that were made for it.
template <class T>
py::object given_away(std::vector<T> numbers, std::vector<py::ssize_t> shape) {
    auto own = std::make_unique<std::vector<T>>(std::move(numbers));
    T* const data = own->data();
    py::capsule keeper(own.release(),
                       [](void* made) { delete static_cast<std::vector<T>*>(made); });
    return py::array_t<T>(std::move(shape), data, keeper);
}

py::tuple eliminated(std::span<const int32_t> kinds, const StationBlocks& blocks, bool from_end) {
    Eliminated found = eliminate(kinds, blocks, from_end);
    const auto m = static_cast<py::ssize_t>(found.kinds.size()), b = blocks.own.rows;
    const auto n = static_cast<py::ssize_t>(found.numbers.size());
    return py::make_tuple(given_away(std::move(found.factors), {m, 2, b, b}),
                          given_away(std::move(found.kinds), {m}),
                          given_away(std::move(found.numbers), {n}));
}

}  // namespace

void offer_stations(py::module_& m) {
    offer_records<StationBlocks, Sections, Turning, ProductArrays, FactorArrays, PassArrays,
                  Changes, PassParts, TrackedLinks>(m);
    m.attr("MIDDLES") = kMiddles;
    CATENARY_OFFER_TYPE(m, "MEETING", Meeting, kind, before, after);
    offer(m, "middle_of", middle_of, "");
    offer(m, "turn", turn, "");
    offer(m, "eliminate", eliminated, "");
    offer(m, "join", join, "m, b=b, * b b, * b b, 2m b b");
    m.def("are_compiled", &are_compiled, py::arg("rows"), py::arg("factors"));
    py::class_<Layout>(m, "Layout")
        .def(py::init(&layout_of), py::arg("own"), py::arg("beside"), py::arg("damped"),
             py::arg("factors"))
        .def("places", &places, py::arg("which"))
        .def_property_readonly("is_sparse", &Layout::is_sparse)
        .def_property_readonly("n_products", [](const Layout& layout) { return layout.of_row(); })
        .def_property_readonly("n_vectors",
                               [](const Layout& layout) { return layout.pieces().n(); })
        .def_property_readonly("row_size", [](const Layout& layout) {
            return layout.of_row() * layout.pieces().vector();
        });
    m.attr("MOST_UNKNOWNS") = kMostUnknowns;
    m.def("targets", &targets);
    m.def("set_target", &set_target, py::arg("name"));
    py::class_<Products>(m, "Products")
        .def(py::init<Layouts, MakeUps, py::object>())
        .def("multiply", &Products::multiply);
    py::class_<Solves>(m, "Solves")
        .def(py::init<Layouts, MakeUps, py::object>())
        .def("solve", &Solves::solve);
    py::class_<TwoPasses>(m, "TwoPasses")
        .def(made_of<TwoPasses, PassParts>("parts"))
        .def("track", taking(&TwoPasses::track, "links"))
        .def("open", taking(&TwoPasses::open, "window"))
        .def("step", &TwoPasses::step)
        .def("predict_velocities", py::overload_cast<>(&TwoPasses::predict_velocities));
}

}  // namespace catenary::python
