#pragma once
// Solution of the small problem where the active set cycles: pivoting, and dependents that carry in
// part.
//
// Contacts and links alone are a linear complementarity problem with a P-matrix, which pivoting
// solves. Bends of one link, and a wheel that slips one way or the other, have a row each; some of
// these act only where others do, and some only where others do not. Only sets that belong to a
// place along the link are taken: with others the matrix is no P-matrix. So a link goes from piece
// to piece of its law, one at a time, and with a law that rises all over it does not come back to
// one: with all rows before its own solved for, its residual has one sign to either side of where
// it stays.
//
// With dependents the matrix is no P-matrix either: the effect of a dropper across it is whole
// while it is taut and none while it is slack, whatever its tension, so it jumps where that passes
// zero. If the jump tightens the dropper that slackens, it is neither taut nor slack. The step then
// ends with its tension at zero and dependents that carry in part (docs/theory/lateral.md).
#include "contact_problem/active_set.hpp"

namespace catenary {

/// Outcome of the solution for forces.
struct Found {
    int64_t rounds;  ///< that were needed; not positive if there is no solution
    bool pivoted;    ///< whether the active set cycled
    CATENARY_RECORD(rounds, pivoted)
};

/// Solve for signs by the active set, and where that does not settle within some rounds by Murty's
/// least-index pivoting: slower, but it cannot cycle for a P-matrix. Dependents go with their
/// leaders, in part if there is no other solution.
Found find_solution(const System& system, const Signs& signs, int64_t max_rounds, const Room& room);

}  // namespace catenary
