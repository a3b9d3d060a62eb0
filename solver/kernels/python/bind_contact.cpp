// Python bindings of contacts, and of the small problem of a step.
#include "contact/contacts.hpp"
#include "contact/response.hpp"
#include "contact_problem/small_problem.hpp"
#include "contact_problem/pivoting.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

/// The zero of a map that Python evaluates.
bool find_zero_of(const py::function& of, std::span<double> z, double width, double small,
                  const Room& room) {
    const Map map = [&of](std::span<const double> at, std::span<double> value) {
        const auto n = static_cast<py::ssize_t>(at.size());
        const auto found = of(py::array_t<double>(n, at.data())).cast<py::array_t<double>>();
        if (found.size() != n) throw py::value_error("the map has the wrong size");
        std::ranges::copy(std::span(found.data(), at.size()), value.begin());
    };
    return find_zero(map, z, width, small, room);
}

}  // namespace

void offer_contact(py::module_& module) {
    offer_records<Wires, Answers, Gains, Followed, ContactWork, Sideways, Across, Contacts, Leads,
                  TrainPlaces, StripEnds, Affine, Bounds, LinkRows, Share>(module);
    offer_records<Tangents, ReportedForces, StepLaw, Coupled, System, Signs, Depths, SmallProblem>(
        module);
    py::class_<Room>(module, "Room", "Room to solve for so many unknowns.")
        .def(py::init<int64_t>(), py::arg("most"))
        .def_readonly("most", &Room::k)
        .def_property_readonly("solution", [](const py::object& own) {
            const auto solution = own.cast<const Room&>().solution;
            return py::array_t<double>(std::ssize(solution), solution.data(), own);
        });
    CATENARY_OFFER_TYPE(module, "NODE", Node, x, y, rest, at, begin, width, local, owned, joined);
    CATENARY_OFFER_TYPE(module, "SAMPLE", Sample, x, height, slope);
    CATENARY_OFFER_TYPE(module, "TOUCH", Touch, first, end, half_length, present, x, element, local,
                        value, slope, whole_value, whole_slope, rest, samples, sample, surface,
                        filled);
    CATENARY_OFFER_TYPE(module, "FLAGS", Flags, rows, stop, broken, missing);
    module.attr("SLIP") = kSlip;
    offer(module, "locate", locate, "n, *, n");
    offer(module, "place", place, "");
    offer(module, "heights", heights, "n=n, n, n");
    offer(module, "find_across", find_across, "");
    offer(module, "respond", respond, "n=n, n=n");
    offer<void, const Contacts&, std::span<const double>>(module, "superpose", superpose, "n=n, n");
    offer<void, const Contacts&, std::span<const int64_t>, std::span<const double>>(
        module, "compensate", compensate, "*, k, k");
    offer(module, "begin_work", begin_work, "");
    offer(module, "add_work", add_work, "n=n, n");
    offer(module, "move_contacts", move_contacts, "");
    offer(module, "write_outputs", write_outputs, "*, n, n, n=n, n");

    module.attr("NOWHERE") = kNowhere;
    offer(module, "subtract", subtract, "n=n, n=n, n, n=n");
    offer(module, "slack_under", slack_under, "w=3n+2, *, *, n");
    offer(module, "under", under, "n=n, w=3n+2 m=m.., n, m, n=n");
    offer(module, "leaves_out", leaves_out, "n, m, w=3n+2, n=n, *");
    offer(module, "solve", solve, "n=n, n=n");
    offer(module, "find_solution", find_solution, "m=m, m=m");
    offer(module, "find_zero", find_zero_of, "");
    module.attr("MOST_TANGENTS") = kMostTangents;
    offer(module, "linearise", linearise, "n=n, n, n");
    offer(module, "remember", remember, "n=n, n, n");
}

}  // namespace catenary::python
