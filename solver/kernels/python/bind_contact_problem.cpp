// What Python calls of the small problem of a step.
#include "contact_problem/forces.hpp"
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
    module.attr("MOST_TANGENTS") = kMostTangents;
    offer(module, "linearise", linearise, "Linearise Hertz's law with hysteresis.");
    offer(module, "remember", remember, "Remember how fast those come who do not touch.");
    offer(module, "agrees", agrees, "Whether forces found with tangents are those of the law.");
}

}  // namespace catenary::python
