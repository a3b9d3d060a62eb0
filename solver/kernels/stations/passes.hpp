#pragma once
// The kernels of `line.hpp` for each kind of blocks, for one target: an instruction set, which
// files that include this set by a pragma, after the headers of the standard library.
#include "stations/blocks.hpp"
#include "stations/line.hpp"

namespace catenary::CATENARY_TARGET {

/// Use of a station's unknowns: stored as the answer of a solve, or taken as accelerations by which
/// Newmark's or the generalized-alpha method moves the station.
enum class Then { kStore, kNewmark, kAlpha };
inline Then then_of(const Work& work) {
    if (work.right) return Then::kStore;
    return work.motion.known ? Then::kAlpha : Then::kNewmark;
}
// Passes take it as an argument, a constant of these types where a pass is compiled for it alone.
using Newmark = std::integral_constant<Then, Then::kNewmark>;
using Alpha = std::integral_constant<Then, Then::kAlpha>;
using IsProduct = std::false_type;

/// Arrays and coefficients of a chain, held by value so that a compiler keeps them in registers.
template <class Blocks>
struct Chained {
    using X = typename Blocks::X;
    struct State {
        X position, velocity;
        CATENARY_INLINE State(const X& x, const X& v) : position(x), velocity(v) {}
        CATENARY_INLINE State(const State& of) : State(of.position, of.velocity) {}
        CATENARY_INLINE State& operator=(const State& of) {
            position = of.position;
            velocity = of.velocity;
            return *this;
        }
    };
    struct Place {
        const double *position, *velocity;
    };

    const Blocks& blocks;
    Table rows, inverse, joined;
    const uint8_t* even;
    const double *factor, *velocity, *loads, *right_side;
    double *answer, *x, *y, *z, *known;
    Changes changes;

    Chained(const Blocks& of, const Work& work, const Run& run)
        : blocks(of),
          rows(work.product.rows),
          inverse(work.factored.inverse),
          joined(work.factored.beside),
          even(work.product.even),
          factor(work.product.factor + run.read),
          velocity(work.product.velocity + run.read),
          loads(work.loads ? work.loads + run.solved : nullptr),
          right_side(work.right + run.solved),
          answer(work.answer + run.solved),
          x(work.motion.x + run.own),
          y(work.motion.y + run.own),
          z(work.motion.z + run.own),
          known(work.motion.known ? work.motion.known + run.own : nullptr),
          changes(work.motion.changes) {}

    CATENARY_INLINE static const double* kept(const double* numbers) {
        asm("" : "+r"(numbers));  // or the compiler computes the address anew for each number
        return numbers;
    }
    /// Where products read a station of the run.
    CATENARY_INLINE Place place(int64_t station) const {
        return {factor + station * blocks.pitch, velocity + station * blocks.pitch};
    }
    CATENARY_INLINE State state(const Place& at) const {
        const X here = blocks.load(at.position);
        if (blocks.is_damped) return {here, blocks.load(at.velocity)};
        return {here, here};
    }
    /// The station before a chain.
    CATENARY_INLINE State outwards(const Chain& chain, int step) const {
        if (!chain.has_before) return state(place(chain.first - step));
        return state({chain.before.position, chain.before.velocity});
    }
    /// Where the one after it is read.
    CATENARY_INLINE Place inwards(const Chain& chain, int step) const {
        if (!chain.has_after) return place(chain.first + step * chain.n);
        return {chain.after.position, chain.after.velocity};
    }
    /// Rows of a product, from the stations before and after it in a chain with this step.
    CATENARY_INLINE Sums<X> product(int64_t i, int step, const State& before, const State& here,
                                    const State& after) const {
        const double* numbers = kept(rows.at(i));
        const int to_start = blocks.own_size, to_end = to_start + blocks.row_beside_size;
        Sums<X> sums = no_sums<X>();
        if constexpr (Blocks::kHasEven)
            if (even[i]) {
                blocks.add_even(sums, numbers, numbers + (step > 0 ? to_end : to_start),
                                before.position, here.position, after.position);
                return sums;
            }
        blocks.add_own(sums, numbers, here.position);
        blocks.add_row_beside(sums, numbers + (step > 0 ? to_start : to_end), before.position);
        blocks.add_row_beside(sums, numbers + (step > 0 ? to_end : to_start), after.position);
        if (blocks.is_damped) {
            numbers += to_end + blocks.row_beside_size;
            blocks.add_own(sums, numbers, here.velocity);
            blocks.add_row_beside(sums, numbers + (step > 0 ? to_start : to_end), before.velocity);
            blocks.add_row_beside(sums, numbers + (step > 0 ? to_end : to_start), after.velocity);
        }
        return sums;
    }
    /// A row of the right-hand side.
    CATENARY_INLINE Sums<X> row(int64_t i, int step, const State& before, const State& here,
                                const State& after) const {
        Sums<X> sums = product(i, step, before, here, after);
        if (loads) sums.one += blocks.load_once(loads + i * blocks.pitch);
        return sums;
    }
    CATENARY_INLINE Sums<X> right(int64_t i) const {
        return sums_from(blocks.load_once(right_side + i * blocks.pitch));
    }
    /// S^-1 times a right-hand side of the Schur complement S.
    CATENARY_INLINE X divided(int64_t i, const X& left) const {
        Sums<X> sums = no_sums<X>();
        blocks.add_inverse(sums, kept(inverse.at(i)), left);
        return blocks.total_of(sums);
    }
    /// Add the matrix's own block with the station behind in a chain with this step.
    CATENARY_INLINE void add_behind(Sums<X>& sums, int64_t i, int step, const X& behind) const {
        blocks.add_beside(sums, kept(joined.at(i)) + (step > 0 ? 0 : blocks.beside_size), behind);
    }
    /// Leave in `answer` the right-hand side of the Schur complement S, after the stations outwards
    /// are eliminated. The station inwards gets S^-1 times it at the end of a chain and where
    /// factors are sparse, else that right-hand side itself.
    CATENARY_INLINE X eliminate(int64_t i, int step, Sums<X> sums, const X& outward,
                                bool is_first) const {
        if (blocks.is_sparse || is_first)
            add_behind(sums, i, step, outward);
        else
            blocks.add_whole(sums, kept(inverse.at(i - step)) + blocks.half_size, outward);
        const X left = blocks.total_of(sums);
        blocks.store(answer + i * blocks.pitch, left);
        return blocks.is_sparse ? divided(i, left) : left;
    }
    CATENARY_INLINE X at_end(const Chain& chain, int step, const X& given_on) const {
        if (blocks.is_sparse || chain.n == 0) return given_on;
        return divided(chain.first + step * (chain.n - 1), given_on);
    }
    /// Unknowns of a station from the unknowns of the station inwards, which is solved already.
    template <class T>
    CATENARY_INLINE X solved(int64_t i, int step, const X& inward, T then) const {
        double* at = answer + i * blocks.pitch;
        X own;
        if (Blocks::kNarrow && !blocks.is_sparse) {
            const double* numbers = kept(inverse.at(i));
            Sums<X> sums = no_sums<X>();
            blocks.add_inverse(sums, numbers, blocks.load(at));
            if constexpr (Blocks::kNarrow)
                blocks.add_transposed(sums, numbers + blocks.half_size, inward);
            own = blocks.total_of(sums);
        } else {
            Sums<X> sums = sums_from(blocks.load_once(at));
            add_behind(sums, i, step, inward);
            own = divided(i, blocks.total_of(sums));
        }
        if (then == Then::kStore)
            blocks.store(at, own);
        else
            go_on(i, own, then);
        return own;
    }
    /// Unknowns of the station where both chains meet, from its right-hand side after the chain
    /// from the start, and from `after`, the last S^-1 r of the chain from the end.
    CATENARY_INLINE X met(int64_t middle, const X& after) const {
        double* at = answer + middle * blocks.pitch;
        Sums<X> sums = sums_from(blocks.load_once(at));
        blocks.add_beside(sums, joined.at(middle) + blocks.beside_size, after);
        const X own = divided(middle, blocks.total_of(sums));
        blocks.store(at, own);
        return own;
    }
    /// Advance a station from one prediction to the next. The solution is its acceleration but for
    /// damping on mass, and for its share of x if the right-hand side was made by M.
    template <class T>
    CATENARY_INLINE void go_on(int64_t i, X solution, T then) const {
        const Changes& c = changes;
        const int64_t at = i * blocks.pitch;
        const X here = blocks.load_once(x + at);
        if (c.by_mass != 0.0) solution = solution.plus(c.by_mass, here);
        if (then == Then::kAlpha) return go_on_by_alpha(at, here, solution);
        const X v = blocks.load_once(y + at), a = solution.plus(-c.damping_share, v);
        blocks.store(z + at, a);
        blocks.store(x + at, here.plus(-c.dt, v).plus(c.by_position, a));
        blocks.store(y + at, v.plus(c.by_velocity, a));
    }
    /// The same for the generalized-alpha method; see `AlphaAhead`.
    CATENARY_INLINE void go_on_by_alpha(int64_t at, const X& here, const X& solution) const {
        const Changes& c = changes;
        const X before = blocks.load_once(z + at), then = blocks.load_once(known + at),
                none = X::all(0.0);
        const X known_now = none.plus(c.known[0], before).plus(c.known[1], then);
        const X v = blocks.load_once(y + at).plus(c.velocity[0], before).plus(c.velocity[1], then);
        const X b = solution.plus(-c.damping_share, v);
        const X total = none.plus(c.balance[0], b).plus(c.balance[1], known_now);
        blocks.store(known + at, known_now);
        blocks.store(x + at, here.plus(-c.dt, v).plus(c.by_position, b).plus(-1.0, total));
        blocks.store(y + at, v.plus(c.by_velocity, b));
        blocks.store(z + at, total);
    }
};

/// The pass forth through one chain; its right-hand sides are given, or products.
template <class Given, class Blocks>
void go_forth(const Blocks& blocks, const Work& work, Chain& chain, int step, Given is_given) {
    using X = typename Blocks::X;
    const Chained<Blocks> one(blocks, work, *chain.run);
    X x = blocks.load(chain.beside->unknowns);
    int64_t i = chain.first;
    if (is_given) {
        for (int64_t k = 0; k < chain.n; ++k, i += step)
            x = one.eliminate(i, step, one.right(i), x, k == 0);
    } else {
        auto before = one.outwards(chain, step), here = one.state(one.place(i));
        const auto last = one.inwards(chain, step);
        for (int64_t k = 1; k <= chain.n; ++k, i += step) {
            const auto after = one.state(k == chain.n ? last : one.place(i + step));
            x = one.eliminate(i, step, one.row(i, step, before, here, after), x, k == 1);
            before = here;
            here = after;
        }
    }
    blocks.store(chain.beside->unknowns, one.at_end(chain, step, x));
}

/// The same through two chains of equal length, side by side.
template <class Given, class Blocks>
void go_forth(const Blocks& blocks, const Work& work, Chain& from_start, Chain& from_end,
              Given is_given) {
    using X = typename Blocks::X;
    const Chained<Blocks> one(blocks, work, *from_start.run), other(blocks, work, *from_end.run);
    X x = blocks.load(from_start.beside->unknowns), y = blocks.load(from_end.beside->unknowns);
    int64_t i = from_start.first, j = from_end.first;
    const int64_t n = from_start.n;
    if (is_given) {
        for (int64_t k = 0; k < n; ++k, ++i, --j) {
            x = one.eliminate(i, 1, one.right(i), x, k == 0);
            y = other.eliminate(j, -1, other.right(j), y, k == 0);
        }
    } else {
        auto before = one.outwards(from_start, 1), here = one.state(one.place(i));
        auto beyond = other.outwards(from_end, -1), there = other.state(other.place(j));
        const auto last = one.inwards(from_start, 1), first = other.inwards(from_end, -1);
        for (int64_t k = 1; k <= n; ++k, ++i, --j) {
            const auto after = one.state(k == n ? last : one.place(i + 1));
            const auto ahead = other.state(k == n ? first : other.place(j - 1));
            x = one.eliminate(i, 1, one.row(i, 1, before, here, after), x, k == 1);
            y = other.eliminate(j, -1, other.row(j, -1, beyond, there, ahead), y, k == 1);
            before = here, here = after, beyond = there, there = ahead;
        }
    }
    blocks.store(from_start.beside->unknowns, one.at_end(from_start, 1, x));
    blocks.store(from_end.beside->unknowns, other.at_end(from_end, -1, y));
}

/// The pass back through one chain.
template <class T, class Blocks>
void go_back(const Blocks& blocks, const Work& work, Chain& chain, int step, T then) {
    const Chained<Blocks> one(blocks, work, *chain.run);
    auto x = blocks.load(chain.beside->unknowns);
    for (int64_t k = 0, i = chain.first; k < chain.n; ++k, i += step)
        x = one.solved(i, step, x, then);
    blocks.store(chain.beside->unknowns, x);
}

/// The same through two chains of equal length, side by side.
template <class T, class Blocks>
void go_back(const Blocks& blocks, const Work& work, Chain& to_start, Chain& to_end, T then) {
    const Chained<Blocks> one(blocks, work, *to_start.run), other(blocks, work, *to_end.run);
    auto x = blocks.load(to_start.beside->unknowns), y = blocks.load(to_end.beside->unknowns);
    int64_t i = to_start.first, j = to_end.first;
    for (int64_t k = 0; k < to_start.n; ++k, --i, ++j) {
        x = one.solved(i, -1, x, then);
        y = other.solved(j, 1, y, then);
    }
    blocks.store(to_start.beside->unknowns, x);
    blocks.store(to_end.beside->unknowns, y);
}

template <class Blocks>
void multiply_rows(const Blocks& blocks, const Work& work, const Chain& chain, double* result) {
    const Chained<Blocks> one(blocks, work, *chain.run);
    auto before = one.outwards(chain, 1), here = one.state(one.place(chain.first));
    const auto last = one.inwards(chain, 1);
    for (int64_t k = 1, i = chain.first; k <= chain.n; ++k, ++i) {
        const auto after = one.state(k == chain.n ? last : one.place(i + 1));
        const auto sums = one.product(i, 1, before, here, after);
        blocks.store(result + i * blocks.pitch, blocks.total_of(sums));
        before = here;
        here = after;
    }
}

/// All kernels of one kind of blocks; for predictions of Newmark's method only if `IsForSteps`.
template <class Blocks, bool IsForSteps = false>
class KernelsOf final : public Kernels {
  public:
    KernelsOf(const Layout& r, const Layout& f) : Kernels(r, f), blocks_(r, f) {}
    bool is_even(const double* rows) const override {
        if constexpr (Blocks::kHasEven) return Blocks::is_even(rows);
        return Kernels::is_even(rows);
    }
    void multiply(const Work& work, const Chain& chain, double* result) const override {
        multiply_rows(blocks_, work, chain, result);
    }
    void forth(const Work& work, Chain& one, int step, Chain* other) const override {
        if constexpr (kSideBySide)
            if (other) return go_forth(blocks_, work, one, *other, is_given(work));
        go_forth(blocks_, work, one, step, is_given(work));
        if (other) go_forth(blocks_, work, *other, -step, is_given(work));
    }
    void meet(const Work& work, const Run& run, int64_t middle, Station& from_end) const override {
        const Chained<Blocks> one(blocks_, work, run);
        const auto own = one.met(middle, blocks_.load(from_end.unknowns));
        blocks_.store(from_end.unknowns, own);
        if (!is_given(work)) one.go_on(middle, own, then(work));
    }
    void back(const Work& work, Chain& one, int step, Chain* other) const override {
        if constexpr (kSideBySide)
            if (other) return go_back(blocks_, work, one, *other, then(work));
        go_back(blocks_, work, one, step, then(work));
        if (other) go_back(blocks_, work, *other, -step, then(work));
    }

  private:
    /// Whether a station leaves the processor waiting for itself: wide ones, and those of several
    /// scenes, have work enough.
    static constexpr bool kSideBySide =
        !IsForSteps && sizeof(typename Blocks::X) <= 12 * sizeof(double);
    static auto is_given([[maybe_unused]] const Work& work) {
        if constexpr (IsForSteps)
            return IsProduct{};
        else
            return work.right != nullptr;
    }
    static auto then([[maybe_unused]] const Work& work) {
        if constexpr (IsForSteps)
            return Newmark{};
        else
            return then_of(work);
    }
    Blocks blocks_;
};

/// Kernels of one kind of blocks for the calls that take most of a step's time: two chains at once,
/// and of a mixed line single ones by Newmark's method as well; others do the rest.
template <class Blocks, bool IsMixed>
class QuickKernels final : public Kernels {
  public:
    QuickKernels(const Layout& r, const Layout& f, std::unique_ptr<Kernels> rest)
        : Kernels(r, f), blocks_(r, f), rest_(std::move(rest)) {}
    void multiply(const Work& work, const Chain& chain, double* result) const override {
        multiply_rows(blocks_, work, chain, result);
    }
    void forth(const Work& work, Chain& one, int step, Chain* other) const override {
        if (other && !work.right) return go_forth(blocks_, work, one, *other, IsProduct{});
        if constexpr (IsMixed)
            if (!work.right) return go_forth(blocks_, work, one, step, IsProduct{});
        rest_->forth(work, one, step, other);
    }
    void meet(const Work& work, const Run& run, int64_t middle, Station& from_end) const override {
        rest_->meet(work, run, middle, from_end);
    }
    void back(const Work& work, Chain& one, int step, Chain* other) const override {
        const bool is_newmark = then_of(work) == Then::kNewmark;
        if (other && is_newmark) return go_back(blocks_, work, one, *other, Newmark{});
        if (other && then_of(work) == Then::kAlpha)
            return go_back(blocks_, work, one, *other, Alpha{});
        if constexpr (IsMixed)
            if (is_newmark) return go_back(blocks_, work, one, step, Newmark{});
        rest_->back(work, one, step, other);
    }

  private:
    Blocks blocks_;
    std::unique_ptr<Kernels> rest_;
};

/// General kernels for the lanes of these rows, with masks found at run time.
template <int W = 2>
std::unique_ptr<Kernels> make_general(const Layout& rows, const Layout& factors) {
    if (rows.pieces().lanes() == W)
        return std::make_unique<KernelsOf<Blocks<W, GivenMasks>>>(rows, factors);
    if constexpr (W < kMostUnknowns)
        return make_general<W + (W < 16 ? 2 : 4)>(rows, factors);
    else
        return nullptr;
}

/// Whether kernels are compiled for one of the shipped lines.
constexpr bool is_compiled([[maybe_unused]] const Shipped& of) {
#if defined(CATENARY_GENERAL_ONLY)
    return false;  // where processors differ much the oldest has the general kernels only
#else
    return is_checked(of);
#endif
}

/// Kernels that were compiled for both, or null.
template <int K = 0>
std::unique_ptr<Kernels> make_quick(const Layout& rows, const Layout& factors) {
    if constexpr (K < std::size(kShipped)) {
        constexpr Shipped s = kShipped[K];
        if constexpr (is_compiled(s)) {
            using Known = Blocks<s.rows.unknowns, KnownMasks<K>>;
            if (rows == s.rows && factors == s.factors)
                return std::make_unique<QuickKernels<Known, s.is_mixed>>(
                    rows, factors, make_general(rows, factors));
        }
        return make_quick<K + 1>(rows, factors);
    }
    return nullptr;
}

std::unique_ptr<Kernels> make(const Layout& rows, const Layout& factors) {
    auto quick = make_quick(rows, factors);
    return quick ? std::move(quick) : make_general(rows, factors);
}

}  // namespace catenary::CATENARY_TARGET
