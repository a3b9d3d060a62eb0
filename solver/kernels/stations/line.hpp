#pragma once
// A line's step without contacts in two passes over its state, for Newmark's family.
//
// The step operator A is block tridiagonal by stations: this is the block Thomas algorithm, begun
// at both ends (a twisted block LU factorisation). With S_i the Schur complements, A's diagonal
// blocks after elimination, and B_i the block between station i and the next one inwards, forth
// from both ends
//     r_i = f_i - B_(i-1)^T S_(i-1)^-1 r_(i-1),
// and back from the middle, where both meet,
//     a_i = S_i^-1 r_i - S_i^-1 B_i a_(i+1).
// The pass forth makes f_i, a row of -K x - C v and of loads, at its station; the pass back
// advances the motion from one prediction to the next (Newmark; Chung and Hulbert, 1993). So the
// state is read from memory once in each pass. Two chains go side by side, from both ends: each
// waits for itself only.
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/arrays.hpp"
#include "stations/layout.hpp"

namespace catenary {

/// Numbers of stations, stored once for each kind.
struct Table {
    const int32_t* begins = nullptr;  ///< of each station the place of its first number
    const double* numbers = nullptr;
    const double* at(int64_t station) const { return numbers + begins[station]; }
};

/// Begins of stations in vectors, and the station type of each; both empty if all are alike.
struct Sections {
    std::span<const int64_t> starts;
    std::span<const uint8_t> station_type;
    CATENARY_RECORD(starts, station_type)
    CATENARY_SHAPES("n, n")
};

/// Operands of a product. Station i of the line is `first` + i of `places`.
struct Product {
    Table rows;
    int64_t first = 0;
    Sections places;
    const double *factor = nullptr, *velocity = nullptr;
    const uint8_t* even = nullptr;  ///< of each station, see `Kernels::is_even`; only of scenes
};

struct Factored {
    Table inverse;  ///< S^-1 alone if factors are sparse, else -B^T S^-1 as well
    Table beside;   ///< the matrix's own blocks B
    Sections places;
};

/// Stations that a step solves for, stations that it moves, and where elimination ends.
struct Ends {
    int64_t begin, end, low, high, middle;
};

/// Rows of a product: of each the place of its first number; the first row's station in `sections`.
struct ProductArrays {
    std::span<const int32_t> kinds;
    std::span<const double> blocks;
    int64_t first;
    Sections sections;
    CATENARY_RECORD(kinds, blocks, first, sections)
    CATENARY_SHAPES("n, *, *, *")

    /// Throws std::invalid_argument if there are fewer stations than rows and one at both ends, or
    /// if blocks have fewer numbers than rows of these layouts.
    Product product(const std::vector<Layout>& layouts) const;
};

/// Factors: of each station the place of its first number, and the same of the matrix's own blocks.
struct FactorArrays {
    std::span<const int32_t> kinds;
    std::span<const double> blocks;
    std::span<const int32_t> beside_kinds;
    std::span<const double> besides;
    int64_t low;                    ///< first station of a rank's own
    std::span<const int64_t> ends;  ///< of `Ends`
    Sections sections;
    CATENARY_RECORD(kinds, blocks, beside_kinds, besides, low, ends, sections)
    CATENARY_SHAPES("n, *, n, *, *, 5, n=n?")

    /// Throws std::invalid_argument if blocks have fewer numbers than factors of these layouts.
    Factored factored(const std::vector<Layout>& layouts) const;
    const Ends& at() const { return *reinterpret_cast<const Ends*>(ends.data()); }
};

/// Numbers that take a state from one prediction to the next; see `PredictedLineState.changes`.
struct Changes {
    double dt;                        ///< [s]
    double by_position, by_velocity;  ///< gains of x [s2] and y [s] by the acceleration of the step
    double damping_share;             ///< of damping on mass that the acceleration lacks [1/s]
    /// Of the generalized-alpha method: shares of z and of the known acceleration before a step in
    /// the known acceleration of the step, in the predicted velocity and in z.
    std::array<double, 2> known, velocity, balance;
    double by_mass;  ///< unless 0, products are with M, and so much of x is added to the answer
    CATENARY_RECORD(dt, by_position, by_velocity, damping_share, known, velocity, balance, by_mass)
};

/// Motion of a rank's own stations: arrays begin at station `low` of all that is solved for.
struct StationMotion {
    double *x = nullptr, *y = nullptr, *z = nullptr, *known = nullptr;
    Changes changes{};
};

/// Stations of one type beside each other, at equal distances in vectors.
struct Run {
    int64_t begin = 0, end = 0;
    /// Where station 0 would be if all had this station type: among the operands of products, among
    /// the unknowns of a solve, in the motion.
    int64_t read = 0, solved = 0, own = 0;
};

/// All that a pass works on.
struct Work {
    Product product;
    Factored factored;
    const double* loads = nullptr;  ///< of all that is solved for, or none
    const double* right = nullptr;  ///< right-hand side of a solve that makes no product
    double* answer = nullptr;
    StationMotion motion;
};

/// Unknowns of a station in the order of its station type, each in all scenes.
struct Station {
    double unknowns[kMostNumbers];
};
/// Displacement and velocity of a station outside of a run, in the order of the run's station type.
struct Outside {
    double position[kMostNumbers], velocity[kMostNumbers];
    Outside() {}  // of most chains nothing is outside: zeros would take longer than the chain
};
/// A chain of n stations of one run: from `first` on, towards the end of the line or its start.
struct Chain {
    const Run* run;
    int64_t first, n;
    Outside before, after;  ///< of the stations beside it, as far as they are outside of the run
    bool has_before = false, has_after = false;
    Station* beside;  ///< of the station before: in and out, in the order of the run's station type
};

/// Kernels of the stations of one type.
class Kernels {
  public:
    Kernels(const Layout& r, const Layout& f) : rows(r), factors(f) {}
    virtual ~Kernels() = default;
    /// Whether these rows of a station are even about it, which some kernels multiply with less.
    virtual bool is_even(const double*) const { return false; }
    /// Rows of a product with K, and -C.
    virtual void multiply(const Work&, const Chain&, double* result) const = 0;
    /// The pass forth through one chain, whose next station is a `step` of 1 or -1 further, and
    /// through another of equal length, if there is one, the other way: the first from the start.
    virtual void forth(const Work&, Chain& one, int step, Chain* other) const = 0;
    /// Solve for the station where both chains meet.
    virtual void meet(const Work&, const Run&, int64_t middle, Station& from_end) const = 0;
    /// The pass back; of two chains the first goes to the start.
    virtual void back(const Work&, Chain& one, int step, Chain* other) const = 0;

    const Layout rows, factors;
};

/// Kernels of these layouts, compiled for them or general; null if there are more unknowns than
/// general ones take.
std::unique_ptr<Kernels> kernels_of(const Layout& rows, const Layout& factors);
/// Kernels of so many scenes side by side, or null if none were compiled.
std::unique_ptr<Kernels> kernels_for_scenes(const Layout& rows, const Layout& factors, int scenes);
/// Kernels that make products only, and kernels that solve only.
std::unique_ptr<Kernels> kernels_of_rows(const Layout& rows);
std::unique_ptr<Kernels> kernels_of_factors(const Layout& factors);
/// Names of the targets that kernels were compiled for and this processor can run, the best last.
std::vector<std::string> targets();
/// Choose one of these; whether it exists.
bool set_target(const std::string& name);

/// Work around the passes of a step: before both, and after each stretch of the pass back.
class Around {
  public:
    virtual ~Around() = default;
    virtual void before() = 0;
    virtual void after_stretch() = 0;
};

/// A line whose stations are of one or of several station types.
class Line {
  public:
    /// `station_types`: places in a cross-section of the stations of each type, of which
    /// the first `kernels.size()` have kernels; one that has all places if stations are alike.
    /// Numbers of each unknown in `scenes` scenes follow each other.
    /// Throws std::invalid_argument if a kernel is null, or a station type is missing.
    Line(std::vector<std::unique_ptr<Kernels>> kernels, std::vector<std::vector<int>> station_types,
         int scenes = 1);

    /// Find the runs of the n stations of a solve. Arrays of motion begin at station `low`.
    void set_runs(const Work&, int64_t n, int64_t low);
    /// Of each of n stations whether its rows are even, see `Kernels`.
    std::vector<uint8_t> even_rows(const Work&, int64_t n) const;
    /// Numbers that the vectors of a solve, and the operands of products, have at least.
    int64_t n_solved() const { return n_solved_; }
    int64_t n_read() const { return n_read_; }
    /// The first number of a station in the vectors of a solve.
    int64_t start_of(const Work&, int64_t station) const;
    void multiply(const Work&, int64_t begin, int64_t end, double* result) const;
    void solve(const Work&, int64_t n, int64_t middle) const;
    /// Both passes, the pass back in stretches of so many pairs of stations.
    void step(const Work&, const Ends&, int64_t stretch, Around&) const;

  private:
    const Run& run_of(int64_t station) const {
        return runs_[run_number_.empty() ? 0 : run_number_[station]];
    }
    int station_type(const Work& work, int64_t station) const {
        const auto of = work.factored.places.station_type;
        return of.empty() ? 0 : of[station];
    }
    struct Way;
    bool alike(int one, int other) const;
    void reorder(int from, int to, const double* given, double* found) const;
    void convert(int from, int to, Station&) const;
    void outside(const Work&, int64_t station, int station_type, Outside&) const;
    void put_outside(const Work&, Chain&, int station_type, int step) const;
    void begin(Way&, int64_t n) const;
    void take(const Work&, bool forth, Way& one, Way* other) const;
    void go_on(const Work&, bool forth, Way& a, Way& b, int64_t n) const;
    Station forth(const Work&, int64_t begin, int64_t end, int64_t middle) const;

    std::vector<std::unique_ptr<Kernels>> kernels_;
    std::vector<std::vector<int>> station_types_;
    int scenes_;
    std::vector<int8_t>
        place_;  ///< of each unknown of a station type in another, -1 if it has none
    std::vector<Run> runs_;
    std::vector<int32_t> run_number_;
    int64_t n_solved_ = 0, n_read_ = 0;
};

}  // namespace catenary
