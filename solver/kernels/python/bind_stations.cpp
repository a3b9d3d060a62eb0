// What Python calls of lines whose unknowns stand in stations.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "python/from_python.hpp"
#include "stations/line.hpp"

namespace catenary::python {

namespace {

template <class T>
using Array = py::array_t<T, py::array::c_style>;

/// An array that is taken as it is: a copy would not be what others read and write.
template <class T>
Array<T> as_is(const py::object& given, const char* name) {
    if (!py::isinstance<Array<T>>(given))
        throw py::type_error(std::string(name) +
                             " is no contiguous array of the type that kernels take");
    return py::reinterpret_borrow<Array<T>>(given);
}

/// Numbers of an array that is kept alive by whoever asks; null if it has none.
template <class T>
const T* in(const Array<T>& array) {
    return array.size() ? array.data() : nullptr;
}

Widths widths_of(const std::vector<int>& given) {
    if (given.empty() || given.size() > kMostPlanes)
        throw py::value_error("a layout has 1 to " + std::to_string(kMostPlanes) + " planes");
    Widths widths{};
    for (size_t p = 0; p < given.size(); ++p) {
        if (given[p] < 1 || given[p] > kMostTerms)
            throw py::value_error("a plane has 1 to " + std::to_string(kMostTerms) + " unknowns");
        widths[p] = static_cast<int8_t>(given[p]);
    }
    return widths;
}

Layout layout_of(const std::vector<int>& widths, const std::vector<int>& own,
                 const std::vector<int>& beside, bool damped, bool sparse, bool general,
                 const std::vector<std::vector<int>>& strands) {
    Layout layout;
    layout.widths = widths_of(widths);
    for (const auto& [differences, into] :
         {std::pair{&own, &layout.own}, {&beside, &layout.beside}})
        for (int d : *differences) {
            if (d < 0 || d >= kMostTerms)
                throw py::value_error("a difference of lanes is from 0 to 15");
            *into |= 1u << d;
        }
    if (strands.size() > kMostStrands) {
        layout.strands[0][0] = kMostLanes + 1;  // none that kernels have
    } else {
        for (size_t s = 0; s < strands.size(); ++s)
            for (size_t u = 0; u < strands[s].size(); ++u)
                layout.strands[s].at(u) = static_cast<int8_t>(strands[s][u] + 1);
    }
    layout.damped = damped;
    layout.sparse = sparse;
    layout.general = general;
    return layout;
}

/// Where stations stand: starts and make-ups, both empty if all are alike.
struct PlacesOf {
    Array<int64_t> starts;
    Array<uint8_t> make_up;
    Places places() const { return {in(starts), in(make_up)}; }
};
PlacesOf places_of(const py::object& given) {
    return {as_is<int64_t>(given.attr("starts"), "starts"),
            as_is<uint8_t>(given.attr("make_up"), "make_up")};
}

/// Rows of a product, see `StationProduct`.
struct Rows {
    Array<int32_t> kinds;
    Array<double> numbers;
    int64_t first;
    PlacesOf places;

    Rows(const py::object& kinds_, const py::object& numbers_, int64_t first_,
         const py::object& places_)
        : kinds(as_is<int32_t>(kinds_, "kinds")),
          numbers(as_is<double>(numbers_, "numbers")),
          first(first_),
          places(places_of(places_)) {}
};
/// Factors, see `StationFactors`.
struct Factors {
    Array<int32_t> kinds;
    Array<double> numbers;
    Array<int32_t> beside_kinds;
    Array<double> besides;
    int64_t low;
    Array<int64_t> ends;
    PlacesOf places;

    Factors(const py::object& kinds_, const py::object& numbers_, const py::object& beside_kinds_,
            const py::object& besides_, int64_t low_, const py::object& ends_,
            const py::object& places_)
        : kinds(as_is<int32_t>(kinds_, "kinds")),
          numbers(as_is<double>(numbers_, "numbers")),
          beside_kinds(as_is<int32_t>(beside_kinds_, "beside_kinds")),
          besides(as_is<double>(besides_, "besides")),
          low(low_),
          ends(as_is<int64_t>(ends_, "ends")),
          places(places_of(places_)) {
        if (ends.size() != 5) throw py::value_error("factors have five ends");
    }
};

void put(const Rows& rows, Work& work) {
    work.product.rows = {in(rows.kinds), in(rows.numbers)};
    work.product.first = rows.first;
    work.product.places = rows.places.places();
}
void put(const Factors& factors, Work& work) {
    work.factored.inverse = {in(factors.kinds), in(factors.numbers)};
    work.factored.beside = {in(factors.beside_kinds), in(factors.besides)};
    work.factored.places = factors.places.places();
}

using Layouts = std::vector<Layout>;
using MakeUps = std::vector<std::vector<int>>;

std::unique_ptr<Kernels> there(std::unique_ptr<Kernels> kernels) {
    if (!kernels) throw py::value_error("no kernels take stations of these layouts");
    return kernels;
}

/// A line with kernels for every make-up, of `n` of which there are layouts.
template <class KernelsOf>
Line line_of(size_t n, const MakeUps& make_ups, KernelsOf kernels_of_make_up) {
    std::vector<std::unique_ptr<Kernels>> kernels;
    for (size_t k = 0; k < n; ++k) kernels.push_back(there(kernels_of_make_up(k)));
    if (make_ups.size() < n) throw py::value_error("a make-up is missing");
    return Line(std::move(kernels), make_ups);
}

/// Products with rows of K, and -C.
class Products {
  public:
    Products(const Layouts& layouts, const MakeUps& make_ups, Rows rows)
        : line_(line_of(layouts.size(), make_ups,
                        [&](size_t k) { return kernels_of_rows(layouts[k]); })),
          rows_(std::move(rows)) {
        put(rows_, work_);
        // Stations of the result stand as those of what is multiplied.
        const int64_t n = rows_.kinds.size();
        if (work_.product.places.starts) {
            starts_.assign(rows_.places.starts.data() + rows_.first,
                           rows_.places.starts.data() + rows_.first + n);
            for (auto& start : starts_) start -= rows_.places.starts.data()[rows_.first];
            work_.factored.places = {starts_.data(), rows_.places.make_up.data() + rows_.first};
        }
        line_.set_runs(work_, n, 0);
    }
    void multiply(int64_t begin, int64_t end, const py::object& factor, const py::object& velocity,
                  const py::object& result) {
        if (begin < 0 || end > rows_.kinds.size()) throw py::value_error("no such rows");
        work_.product.factor = as_is<double>(factor, "factor").data();
        work_.product.velocity = as_is<double>(velocity, "velocity").data();
        line_.multiply(work_, begin, end, as_is<double>(result, "result").mutable_data());
    }

  private:
    Line line_;
    Rows rows_;
    Work work_;
    std::vector<int64_t> starts_;
};

/// Solves with factors.
class Solves {
  public:
    Solves(const Layouts& layouts, const MakeUps& make_ups, Factors factors)
        : line_(line_of(layouts.size(), make_ups,
                        [&](size_t k) { return kernels_of_factors(layouts[k]); })),
          factors_(std::move(factors)) {
        put(factors_, work_);
        line_.set_runs(work_, factors_.kinds.size(), 0);
    }
    void solve(const py::object& right, const py::object& answer) {
        work_.right = as_is<double>(right, "right").data();
        work_.answer = as_is<double>(answer, "answer").mutable_data();
        line_.solve(work_, factors_.kinds.size(), factors_.ends.data()[4]);
    }

  private:
    Line line_;
    Factors factors_;
    Work work_;
};

/// Steps in two passes, for compiled loops and from Python.
class Passes {
  public:
    Passes(const std::vector<std::pair<Layout, Layout>>& layouts, const MakeUps& make_ups,
           Rows rows, Factors factors, const std::vector<py::object>& arrays,
           const std::array<double, 11>& changes)
        : line_(line_of(layouts.size(), make_ups,
                        [&](size_t k) { return kernels_of(layouts[k].first, layouts[k].second); })),
          rows_(std::move(rows)),
          factors_(std::move(factors)) {
        if (arrays.size() != 8) throw py::value_error("passes take eight arrays");
        for (const auto& array : arrays)
            arrays_.push_back(as_is<double>(array, "an array of the passes"));
        put(rows_, work_);
        put(factors_, work_);
        auto at = [&](int number) {
            auto& array = arrays_[number];
            return array.size() ? array.mutable_data() : nullptr;
        };
        work_.product.factor = at(0);
        work_.product.velocity = at(1);
        work_.loads = at(2);
        work_.answer = at(3);
        const auto& c = changes;
        work_.motion = {at(4),
                        at(5),
                        at(6),
                        at(7),
                        {c[0], c[1], c[2], c[3], {c[4], c[5]}, {c[6], c[7]}, {c[8], c[9]}, c[10]}};
        line_.set_runs(work_, factors_.kinds.size(), factors_.low);
    }
    /// What is called before both passes, and after each `stretch` of the pass back.
    void call(int64_t stretch, std::pair<size_t, size_t> ahead,
              std::pair<size_t, size_t> following) {
        stretch_ = std::max<int64_t>(1, stretch);
        ahead_ = call_of(ahead);
        following_ = call_of(following);
    }
    void step() {
        line_.step(work_, *reinterpret_cast<const Ends*>(factors_.ends.data()), stretch_, ahead_,
                   following_);
    }
    std::pair<size_t, size_t> address() {
        return {reinterpret_cast<size_t>(&Passes::take), reinterpret_cast<size_t>(this)};
    }

  private:
    static Call call_of(const std::pair<size_t, size_t>& address) {
        return {reinterpret_cast<void (*)(void*)>(address.first),
                reinterpret_cast<void*>(address.second)};
    }
    static void take(void* passes) { static_cast<Passes*>(passes)->step(); }

    Line line_;
    Rows rows_;
    Factors factors_;
    std::vector<Array<double>> arrays_;
    Work work_;
    int64_t stretch_ = 1;
    Call ahead_, following_;
};

}  // namespace

void offer_stations(py::module_& m) {
    py::class_<Layout>(m, "Layout")
        .def(py::init(&layout_of), py::arg("widths"), py::arg("own"), py::arg("beside"),
             py::arg("damped"), py::arg("sparse"), py::arg("general"), py::arg("strands"));
    m.def(
        "has_widths", [](const std::vector<int>& widths) { return has_widths(widths_of(widths)); },
        py::arg("widths"));
    m.def("has_strands", &has_strands, py::arg("factors"));
    m.def("targets", &targets);
    m.def("set_target", &set_target, py::arg("name"));
    py::class_<Rows>(m, "Rows").def(py::init<py::object, py::object, int64_t, py::object>());
    py::class_<Factors>(m, "Factors")
        .def(py::init<py::object, py::object, py::object, py::object, int64_t, py::object,
                      py::object>());
    py::class_<Products>(m, "Products")
        .def(py::init<Layouts, MakeUps, Rows>())
        .def("multiply", &Products::multiply);
    py::class_<Solves>(m, "Solves")
        .def(py::init<Layouts, MakeUps, Factors>())
        .def("solve", &Solves::solve);
    py::class_<Passes>(m, "Passes")
        .def(py::init<std::vector<std::pair<Layout, Layout>>, MakeUps, Rows, Factors,
                      std::vector<py::object>, std::array<double, 11>>())
        .def("call", &Passes::call)
        .def("step", &Passes::step)
        .def_property_readonly("address", &Passes::address);
}

}  // namespace catenary::python
