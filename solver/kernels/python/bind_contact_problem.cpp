// What Python calls of the small problem of a step.
#include "contact_problem/small_problem.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

std::tuple<int64_t, int64_t, bool, bool> solve_problem(const SmallProblem& problem) {
    const Solved solved = solve(problem);
    return {solved.rounds, solved.size, solved.finite, solved.complete};
}

}  // namespace

void offer_contact_problem(py::module_& module) {
    module.attr("NOWHERE") = kNowhere;
    offer(module, "subtract", subtract, "Fill in the gap without forces.");
    offer(module, "any_switched", any_switched, "Whether contact forces alone switch a link.");
    offer(module, "couple", couple, "Put rows and columns of links beside those of contacts.");
    offer(module, "solve_on", solve_on, "Solve the rows and columns that act.");
    offer(module, "settle", settle, "Active-set iteration; rounds needed, else none above zero.");
    offer(module, "under", under, "Fill in depths and rates under forces and compensations.");
    offer(module, "leaves_out", leaves_out, "Whether a link without a row may have switched.");
    offer(module, "solve", solve_problem,
          "Contact forces and compensations: rounds, unknowns used, finite, complete.");
    offer(module, "linearise", linearise, "Tangents of Hertz's law with hysteresis, and forces.");
}

}  // namespace catenary::python
