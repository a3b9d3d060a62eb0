#pragma once
// Derivatives of a march by its parameters: tangents, stepped beside the march.
//
// A step solves M a + C v + K d = sum_i b_i f_i - sum_l L_l s_l with forces of contacts and
// compensations of links. Its derivative by a parameter p, written d., is a motion of the same
// line:
//
//     M da + C dv + K dd = sum_i (b_i df_i + db_i f_i) - sum_l (L_l ds_l + dL_l s_l)
//                          - dM a - dC v - dK d,
//
// by the same method and with the same factors. Contacts that touch and links that have switched
// keep their laws, differentiated; others keep no force. Heads and contact laws likewise.
#include "steps/steps.hpp"
#include "tangents/head_tangents.hpp"
#include "tangents/tangent_lanes.hpp"

namespace catenary {

/// Derivatives of all links of the line by their numbers: rest, stiffness and damping of their laws
/// (n, 3), and weights of their directions (n, m); no rows if nothing changes.
struct LinkChange {
    Array2<const double> law, weights;
    CATENARY_RECORD(law, weights)
    CATENARY_SHAPES("n 3?, n *?")
};

/// Derivatives of the contact law at n contacts: of own, offset, by_depth and by_rate (4, n), and,
/// of a Hertzian law, of K, n, chi and the least speed (4,); empty if they do not change.
struct LawChange {
    Array2<const double> tangents;
    std::span<const double> hertz;
    std::span<double> speed;   ///< of the rates at which gaps closed (n,)
    std::span<double> latest;  ///< of the latest forces (n,)
    CATENARY_RECORD(tangents, hertz, speed, latest)
    CATENARY_SHAPES("4 n?, 4?, n, n")
};

/// A march differentiated by one parameter.
struct Tangent {
    Array2<const double> rest;  ///< of the wires' nodes at rest (n_nodes, 2), or no rows
    LinkChange links;
    std::vector<HeadChange> heads;
    Array3<const double> drives;  ///< of the heads (n, n_heads, width) in all steps, in one for
                                  ///< all of them, or in none
    LawChange law;
    std::span<const double> start;  ///< of the places of contacts at the start (n,)
    double speed;                   ///< of the train's speed
    Array2<double> results;         ///< (n, 2 n_pantographs + n_arms) of each step of the march:
                                    ///< contact forces, displacements at arms, heights of heads
    CATENARY_RECORD(rest, links, heads, drives, law, start, speed, results)
    CATENARY_SHAPES("* 2?")
};

/// Tangents with a motion of the line in each lane; the last lanes may have none.
struct TangentGroup {
    TangentLanes lanes;
    std::vector<Tangent> tangents;
    CATENARY_RECORD(lanes, tangents)
};

/// Tangents of a march, the parts of it that they read, and the counts that they fill in.
struct MarchTangents {
    std::vector<TangentGroup> groups;
    /// Two copies of each head that is no linear chain, for changed states.
    std::vector<std::vector<Head*>> pairs;
    Links links;                     ///< of the line, by their numbers
    std::span<const int64_t> arms;   ///< unknowns whose displacements are shown
    std::span<const int64_t> first;  ///< (1,) steps of the march before the block
    std::span<int64_t> switches;     ///< (3,) steps in which a contact is open, in which a contact
                                     ///< opened or closed, and in which links switched
    CATENARY_RECORD(groups, pairs, links, arms, first, switches)
};

/// Steps with tangents.
class TangentSteps : public Steps {
  public:
    /// Throws std::invalid_argument if a head is no linear chain and has no copies.
    TangentSteps(StepParts parts, Block block, MarchTangents tangents);
    /// Take steps as `Steps::take`; steps that are left to others have no tangents.
    Taken take(int64_t first, int64_t end);

  private:
    /// Acting contacts, and acting links by their rows and by their numbers.
    struct Acting {
        std::vector<int64_t> contacts, rows, numbers;
    };

    void find_acting();
    void count();
    void fill_matrix() const;
    void follow(const TangentGroup& group, int64_t number);
    void wake(LanePasses& passes) const;
    void solve(const Tangent& tangent, const Motion& own);
    void load(const Tangent& tangent, const TangentLanes& lanes, int64_t lane, double way) const;
    /// The number of a step of the block in the march.
    int64_t in_march(int64_t number) const { return tangents_.first[0] + number; }
    Array2<const double> changed_drives(const Tangent& tangent, int64_t number) const;
    void find_places(const Tangent& tangent, const Motion& own, double way);
    double of_law(const Tangent& tangent, int64_t contact) const;
    double of_reserve(const Tangent& tangent, const Motion& own, int64_t link) const;
    void remember(const Tangent& tangent) const;
    void show(const Tangent& tangent, int64_t number) const;
    void show_arms(const TangentGroup& group, int64_t number) const;

    std::span<const double> force() const { return parts().problem.room->solution; }
    int64_t n_contacts() const { return size(parts().problem.found.depth); }

    MarchTangents tangents_;
    HeadTangents heads_;
    std::vector<double> place_, rate_;      ///< derivatives of gaps without forces
    std::vector<double> right_, solution_;  ///< of the small problem, in the march's unknowns
    std::vector<double> side_by_side_;  ///< forces of contacts, and of acting links, in all lanes
    Acting acting_, was_;
    bool has_begun_ = false;
};

}  // namespace catenary
