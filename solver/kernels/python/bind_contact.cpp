// Python bindings of contacts, and of the small problem of a step.
#include "contact/contacts.hpp"
#include "contact/outputs.hpp"
#include "contact/response.hpp"
#include "contact_problem/forces.hpp"
#include "contact_problem/simplicial_path.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

std::tuple<int64_t, int64_t, bool, bool, bool> solve_problem(const SmallProblem& problem) {
    const Solved solved = solve(problem);
    return {solved.rounds, solved.size, solved.finite, solved.complete, solved.pivoted};
}

std::tuple<int64_t, bool> find_signed(const System& system, const Signs& signs, int64_t max_rounds,
                                      const Room& room) {
    const Found found = find_solution(system, signs, max_rounds, room);
    return {found.rounds, found.pivoted};
}

/// A map that Python evaluates.
class CalledMap : public Map {
  public:
    explicit CalledMap(const py::function& of) : of_(of) {}
    void at(std::span<const double> z, std::span<double> value) override {
        const py::array_t<double> at(static_cast<py::ssize_t>(z.size()), z.data());
        const auto found = of_(at).cast<py::array_t<double>>();
        if (found.size() != at.size()) throw py::value_error("the map has the wrong size");
        std::ranges::copy(std::span(found.data(), z.size()), value.begin());
    }

  private:
    const py::function& of_;
};

bool find_zero_of(const py::function& of, std::span<double> z, double width, double small,
                  const Room& room) {
    CalledMap map(of);
    return find_zero(map, z, width, small, room.pivoting.path, room);
}

}  // namespace

void offer_contact(py::module_& module) {
    PYBIND11_NUMPY_DTYPE(Node, x, y, rest, at, begin, width, local, owned, joined);
    PYBIND11_NUMPY_DTYPE(Sample, x, height, slope);
    PYBIND11_NUMPY_DTYPE(Touch, first, end, half_length, present, x, element, local, value, slope,
                         whole_value, whole_slope, rest, samples, sample, surface, filled);
    PYBIND11_NUMPY_DTYPE(Flags, rows, stop, broken, missing);
    module.attr("NODE") = py::dtype::of<Node>();
    module.attr("SAMPLE") = py::dtype::of<Sample>();
    module.attr("TOUCH") = py::dtype::of<Touch>();
    module.attr("FLAGS") = py::dtype::of<Flags>();
    module.attr("SLIP") = kSlip;
    offer(module, "locate", locate, "Make touches those at some places.");
    offer(module, "place", place, "Find places of contacts and the answers to forces there.");
    offer(module, "heights", heights,
          "Fill in wire heights [m] and total rates [m/s] at contacts.");
    offer(module, "find_across", find_across, "Fill in where wires are across the track.");
    offer(module, "respond", respond, "Fill in a rank's share of the small problem.");
    offer(module, "superpose", superpose, "Add the answers to contact forces.");
    offer(module, "compensate", compensate, "Add the answers to compensations of links.");
    offer(module, "begin_work", begin_work, "Keep velocities at contacts before a step.");
    offer(module, "add_work", add_work, "Add the work of contact forces in a step.");
    offer(module, "move_contacts", move_contacts, "Move contacts and pantographs along the track.");
    offer(module, "write_outputs", write_outputs,
          "Fill in outputs of pantographs at the end of a step.");

    module.attr("NOWHERE") = kNowhere;
    offer(module, "subtract", subtract, "Fill in the gap without forces.");
    offer(module, "any_switched", any_switched, "Whether contact forces alone switch a link.");
    offer(module, "couple", couple, "Put rows and columns of links beside those of contacts.");
    offer(module, "under", under, "Fill in depths and rates under forces and compensations.");
    offer(module, "leaves_out", leaves_out, "Whether a link without a row may have switched.");
    offer(module, "solve", solve_problem,
          "Contact forces and compensations: rounds, unknowns used, finite, complete, pivoted.");
    offer(module, "find_solution", find_signed, "Active set, then pivoting: rounds, pivoted.");
    offer(module, "pivot", pivot, "Least-index pivoting; rounds needed, else none above zero.");
    offer(module, "find_zero", find_zero_of, "Find a zero of a map; whether there is one.");
    module.attr("MOST_TANGENTS") = kMostTangents;
    offer(module, "linearise", linearise, "Linearise Hertz's law with hysteresis.");
    offer(module, "remember", remember, "Remember how fast those come who do not touch.");
    offer(module, "agrees", agrees, "Whether forces found with tangents are those of the law.");
}

}  // namespace catenary::python
