// LU factors of the rows that act, the active-set iteration, Merrill's path of simplices, grid
// after grid, Murty's least-index pivoting, and shares of dependents by simplicial paths.
#include "contact_problem/pivoting.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace catenary {

namespace {

/// Solve for two unknowns, with the operations in the same order as for more.
void solve_two(const System& system, int64_t first, int64_t second) {
    const auto& [matrix, right, solution] = system;
    const bool swaps = std::abs(matrix(second, first)) > std::abs(matrix(first, first));
    const int64_t top = swaps ? second : first, low = swaps ? first : second;
    const double share = matrix(low, first) / matrix(top, first);
    const double pivot = matrix(low, second) - share * matrix(top, second);
    double x = 0.0, y = 0.0;
    for (int pass = 0; pass < 2; ++pass) {
        const double of_top = right[top] - matrix(top, first) * x - matrix(top, second) * y;
        const double of_low = right[low] - matrix(low, first) * x - matrix(low, second) * y;
        const double change = (of_low - share * of_top) / pivot;
        y += change;
        x += (of_top - matrix(top, second) * change) / matrix(top, first);
    }
    solution[first] = x;
    solution[second] = y;
}

/// LU factors of the rows and columns `index`; row i of the factors was row order[i].
void eliminate(const Array2<double>& matrix, std::span<const int64_t> index,
               const Array2<double>& a, std::span<int64_t> order) {
    const int64_t m = size(index);
    std::iota(order.begin(), order.end(), 0);
    for (int64_t i = 0; i < m; ++i)
        for (int64_t j = 0; j < m; ++j) a(i, j) = matrix(index[i], index[j]);
    for (int64_t k = 0; k < m; ++k) {
        int64_t pivot = k;
        for (int64_t i = k + 1; i < m; ++i)
            if (std::abs(a(i, k)) > std::abs(a(pivot, k))) pivot = i;
        if (pivot != k) {
            std::swap(order[k], order[pivot]);
            for (int64_t j = 0; j < m; ++j) std::swap(a(k, j), a(pivot, j));
        }
        for (int64_t i = k + 1; i < m; ++i) {
            a(i, k) /= a(k, k);
            for (int64_t j = k + 1; j < m; ++j) a(i, j) -= a(i, k) * a(k, j);
        }
    }
}

}  // namespace

void solve_on(const System& system, std::span<const bool> acts, const Room& room) {
    const auto& [matrix, right, solution] = system;
    int64_t m = 0;
    for (int64_t i = 0; i < size(acts); ++i) {
        solution[i] = 0.0;
        if (acts[i]) room.acting[m++] = i;
    }
    const auto index = room.acting.first(m), order = room.order.first(m);
    // One or two contacts and taut droppers, mostly.
    if (m == 1) solution[index[0]] = right[index[0]] / matrix(index[0], index[0]);
    if (m == 2) solve_two(system, index[0], index[1]);
    if (m < 3) return;
    const Array2<double>& a = room.factors;
    const auto left = room.left.first(m), change = room.change.first(m);
    eliminate(matrix, index, a, order);
    for (int pass = 0; pass < 2; ++pass) {
        for (int64_t i = 0; i < m; ++i) {
            double value = right[index[i]];
            for (int64_t j = 0; j < m; ++j)
                value -= matrix(index[i], index[j]) * solution[index[j]];
            left[i] = value;
        }
        for (int64_t i = 0; i < m; ++i) {
            double value = left[order[i]];
            for (int64_t j = 0; j < i; ++j) value -= a(i, j) * change[j];
            change[i] = value;
        }
        for (int64_t i = m - 1; i >= 0; --i) {
            double value = change[i];
            for (int64_t j = i + 1; j < m; ++j) value -= a(i, j) * change[j];
            change[i] = value / a(i, i);
            solution[index[i]] += change[i];
        }
    }
}

namespace {

/// Primal-dual active-set iteration (semismooth Newton) for x = max(0, x - (matrix x - right)),
/// freely for `always`, and freely with its leader for a row `behind` one. Returns the rounds
/// needed, which are not positive if the set did not settle, or came back to one that it has had.
int64_t settle(const System& system, const Signs& signs, int64_t max_rounds, const Room& room) {
    const auto& [matrix, right, solution] = system;
    const auto& [always, behind] = signs;
    const int64_t n = size(right);
    const auto acts = room.acts.first(n), before = room.before.first(n);
    for (int64_t i = 0; i < n; ++i)
        acts[i] = behind[i] ? acts[i - behind[i]] : always[i] || right[i] > 0.0;
    int64_t kept_at = 1;
    for (int64_t rounds = 1; rounds <= max_rounds; ++rounds) {
        // Each set determines the next one: a set that comes again is in a cycle. One is kept for
        // twice as many rounds as the one before it (R. P. Brent, BIT 20 (1980) 176-184).
        if (rounds == kept_at) {
            std::ranges::copy(acts, before.begin());
            kept_at *= 2;
        }
        solve_on(system, acts, room);
        bool changed = false;
        for (int64_t i = 0; i < n; ++i) {
            if (behind[i]) {
                acts[i] = acts[i - behind[i]];
                continue;
            }
            double residual = -right[i];
            for (int64_t j = 0; j < n; ++j) residual += matrix(i, j) * solution[j];
            const bool now = always[i] || solution[i] - residual > 0.0;
            changed = changed || now != acts[i];
            acts[i] = now;
        }
        if (!changed) return rounds;
        if (std::ranges::equal(acts, before)) return -rounds;
    }
    return -max_rounds;
}

/// Corners of the first simplex lie so around the start that no face of a grid holds a zero of a
/// map with whole numbers in it: two steps of a path would be equally good there.
constexpr double kSkew = std::numbers::phi - 1.0;
/// Each grid is so much finer than the one before.
constexpr double kFiner = 0.25;
/// No grid is finer than round-off of the places in it.
constexpr double kFinest = 1e-14;
/// A column that enters takes this much of another, or none.
constexpr double kNothing = 1e-12;
/// Simplices of one path; it has some n^2 of them on a grid as wide as the way to go.
constexpr int64_t kMostSimplices = 20'000;

bool all_finite(std::span<const double> numbers) {
    return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

/// The path on one grid.
class Path {
  public:
    Path(const Map& of, std::span<const double> start, double width, const Room& room)
        : of_(of), start_(start), width_(width), room_(room) {
        std::ranges::fill(all_, true);
        std::ranges::fill(zero_, 0.0);
        zero_[n_] = 1.0;
        std::ranges::fill(first_, 0);
        std::iota(order_.begin(), order_.end(), 0);
        std::iota(held_.begin(), held_.end(), 0);
        // Shares of the start in the corners of the first simplex, all positive.
        double total = 0.0, behind = 0.0;
        for (int64_t i = 0; i <= n_; ++i) total += share(i);
        for (int64_t i = n_; i-- > 0;) {
            behind += share(i + 1) / total;
            origin_[i] = start_[i] - width_ * behind;
        }
    }

    /// Fill in the zero on level 1 of the interpolation between corners; whether there is one.
    bool arrive(std::span<double> zero) {
        for (int64_t k = 0; k <= n_; ++k) {
            put_column(k);
            put_entering(k);
        }
        int64_t enters = n_ + 1;
        for (int64_t number = 0; number < kMostSimplices; ++number) {
            put_column(enters);
            if (!all_finite(entering_)) return false;
            solve(zero_, weights_);
            solve(entering_, change_);
            const int64_t leaves = leaving();
            if (leaves < 0) return false;
            const int64_t gone = held_[leaves];
            held_[leaves] = enters;
            put_entering(leaves);
            if (is_on_map()) {
                solve(zero_, weights_);
                put_zero(zero);
                return all_finite(zero);
            }
            enters = go_on(gone);
        }
        return false;
    }

  private:
    static double share(int64_t i) { return 1.0 + std::pow(kSkew, static_cast<double>(i + 1)); }

    /// Go to a corner of the simplex, whose steps from corner to corner go along the axes in order.
    void go_to(int64_t number) {
        std::ranges::copy(first_, corner_.begin());
        for (int64_t i = 0; i < number; ++i) ++corner_[order_[i]];
    }
    double at(int64_t axis) const {
        return origin_[axis] + width_ * static_cast<double>(corner_[axis]);
    }
    /// Put the value at a corner into the entering column, of like size in all rows, however fine
    /// the grid.
    void put_column(int64_t number) {
        go_to(number);
        for (int64_t i = 0; i < n_; ++i) place_[i] = at(i);
        if (corner_[n_] != 0)
            of_(place_, entering_.first(n_));
        else
            for (int64_t i = 0; i < n_; ++i) entering_[i] = place_[i] - start_[i];
        for (int64_t i = 0; i < n_; ++i) entering_[i] /= width_;
        entering_[n_] = 1.0;
    }
    void put_entering(int64_t column) {
        for (int64_t i = 0; i <= n_; ++i) columns_(i, column) = entering_[i];
    }
    void solve(std::span<double> right, std::span<double> solution) const {
        solve_on({columns_, right, solution}, all_, room_);
    }
    /// Number of the column that leaves, -1 if none does.
    int64_t leaving() const {
        if (!all_finite(weights_) || !all_finite(change_)) return -1;
        int64_t leaves = -1;
        for (int64_t k = 0; k <= n_; ++k)
            if (change_[k] > kNothing &&
                (leaves < 0 || weights_[k] / change_[k] < weights_[leaves] / change_[leaves]))
                leaves = k;
        return leaves;
    }
    /// Whether all corners whose columns are held are on level 1.
    bool is_on_map() {
        return std::ranges::all_of(held_, [&](int64_t number) {
            go_to(number);
            return corner_[n_] != 0;
        });
    }
    void put_zero(std::span<double> zero) {
        std::ranges::fill(zero, 0.0);
        for (int64_t k = 0; k <= n_; ++k) {
            go_to(held_[k]);
            for (int64_t i = 0; i < n_; ++i) zero[i] += weights_[k] * at(i);
        }
    }
    /// Go to the simplex behind the face opposite to the corner that is gone; its new corner.
    int64_t go_on(int64_t gone) {
        if (gone == 0) {
            ++first_[order_[0]];
            std::ranges::rotate(order_, order_.begin() + 1);
            for (int64_t& number : held_) --number;
            return n_ + 1;
        }
        if (gone == n_ + 1) {
            --first_[order_[n_]];
            std::ranges::rotate(order_, order_.end() - 1);
            for (int64_t& number : held_) ++number;
            return 0;
        }
        std::swap(order_[gone - 1], order_[gone]);
        return gone;
    }

    std::span<double> numbers(int64_t k) const { return room_.path.numbers[k].first(n_ + 1); }
    std::span<int64_t> counts(int64_t k) const { return room_.path.counts[k].first(n_ + 1); }

    const Map& of_;
    std::span<const double> start_;
    double width_;
    const Room& room_;
    int64_t n_ = size(start_);
    Array2<double> columns_ = room_.path.columns;
    std::span<double> origin_ = numbers(0).first(n_), zero_ = numbers(1), entering_ = numbers(2),
                      weights_ = numbers(3), change_ = numbers(4), place_ = numbers(5).first(n_);
    std::span<int64_t> order_ = counts(0), first_ = counts(1), corner_ = counts(2),
                       held_ = counts(3);
    std::span<bool> all_ = part(room_.path.all, 0, n_ + 1);
};

}  // namespace

bool find_zero(const Map& of, std::span<double> z, double width, double small, const Room& room) {
    const auto value = room.path.numbers[6].first(z.size());
    auto is_zero = [&] {
        of(z, value);
        return std::ranges::all_of(value, [&](double each) { return std::abs(each) <= small; });
    };
    for (; width > kFinest; width *= kFiner) {
        if (is_zero()) return true;
        if (!Path(of, z, width, room).arrive(value)) return false;
        std::ranges::copy(value, z.begin());
    }
    return is_zero();
}

namespace {

/// Shares go from 0 to 1; paths on a grid of some of that take the fewest steps.
constexpr double kFirstGrid = 0.25;
/// Tolerance of a row's residual relative to the largest right-hand side; and, as that makes the
/// problem jump from shares to shares, tolerance of the agreement of shares with tensions.
constexpr double kRounding = 1e-12, kAgreement = 10.0 * kRounding;
/// Rows of bends along one direction differ by this at most, of their largest number.
constexpr double kAlike = 1e-9;
/// Problems that one step may solve to find shares.
constexpr int64_t kMostEvaluations = 100'000;

double largest(std::span<const double> numbers) {
    double found = 0.0;
    for (double number : numbers) found = std::max(found, std::abs(number));
    return found;
}

/// A row of a matrix less the unit matrix.
struct Beside {
    const Array2<double>& matrix;
    int64_t row;
    double operator[](int64_t column) const {
        return matrix(row, column) - (row == column ? 1.0 : 0.0);
    }
};

/// Find how rows of bends along one direction go with each other: i `needs` j if it acts only while
/// j does, and `excludes` it if it does not while j does.
///
/// But for a unit matrix they are multiples of one row u, c u, and act where u x is below right / c
/// of a positive c, and above it of a negative one.
void find_bends(const System& system, const Room& room) {
    const auto& [matrix, right, solution] = system;
    const int64_t n = size(right);
    const auto& needs = room.needs;
    const auto& excludes = room.excludes;
    const auto scale = room.left.first(n);
    const auto peak = room.acting.first(n);
    for (int64_t i = 0; i < n; ++i) {
        const Beside own{matrix, i};
        peak[i] = 0;
        for (int64_t k = 1; k < n; ++k)
            if (std::abs(own[k]) > std::abs(own[peak[i]])) peak[i] = k;
        scale[i] = std::abs(own[peak[i]]);
    }
    auto along = [&](int64_t i, int64_t j) {
        const Beside one{matrix, i}, other{matrix, j};
        if (i == j || scale[i] == 0.0 || scale[j] == 0.0) return 0.0;
        if (std::abs(other[peak[i]]) < 0.99 * scale[j]) return 0.0;  // of most rows
        const double sign = std::copysign(1.0, one[peak[i]] * other[peak[i]]);
        auto differ = [&](int64_t k) {
            return !(std::abs(one[k] / scale[i] - sign * other[k] / scale[j]) <= kAlike);
        };
        for (int64_t k = 0; k < n; ++k)
            if (differ(k)) return 0.0;
        return sign;
    };
    for (int64_t i = 0; i < n; ++i)
        for (int64_t j = 0; j < n; ++j) {
            const double sign = along(i, j);
            needs(i, j) = excludes(i, j) = false;
            if (sign == 0.0) continue;
            // Where along u of row i both begin to act, i below its place.
            const double place = right[i] / scale[i], other = sign * right[j] / scale[j];
            needs(i, j) = sign > 0.0 && other > place;
            excludes(i, j) = sign < 0.0 && other >= place;
        }
}

/// Outcome of pivoting: whether a set solves the problem, the rounds, the number of turned rows,
/// and how many of these were before a cycle of sets.
struct Pivoted {
    bool found;
    int64_t rounds, n_turned, since;
};

/// Number of turned rows before the cycle that ends at the present set: from there on each row is
/// turned an even number of times. `n_turned` if there is no cycle.
int64_t circle_since(std::span<const int64_t> turned, std::span<bool> odd) {
    const int64_t n_turned = size(turned);
    std::ranges::fill(odd, false);
    int64_t n_odd = 0;
    for (int64_t s = n_turned; s-- > 0;) {
        bool& own = odd[turned[s]];
        own = !own;
        n_odd += own ? 1 : -1;
        if (n_odd == 0) return s;
    }
    return n_turned;
}

/// Pivot from set to set, from `room.acts` on, until one solves the problem or comes again.
Pivoted pivot_from(const System& system, const Signs& signs, const Room& room) {
    const auto& [matrix, right, solution] = system;
    const auto& [always, behind] = signs;
    const auto& needs = room.needs;
    const auto& excludes = room.excludes;
    const auto& turned = room.turned;
    const int64_t n = size(right), most = 20 * n + 100;
    const auto acts = room.acts.first(n);
    const double little = kRounding * (1.0 + largest(right));
    // Of bends along one direction the next one turns, whichever are wrong.
    auto held = [&](int64_t i) {
        for (int64_t j = 0; j < n; ++j)
            if (needs(j, i) && acts[j]) return true;
        return always[i];
    };
    auto barred = [&](int64_t i) {
        for (int64_t j = 0; j < n; ++j)
            if (acts[j] ? excludes(i, j) : needs(i, j)) return true;
        return false;
    };
    auto is_wrong = [&](int64_t i) {
        if (behind[i] != 0) return false;
        if (acts[i]) return solution[i] < -little && !held(i);
        double residual = -right[i];
        for (int64_t j = 0; j < n; ++j) residual += matrix(i, j) * solution[j];
        return residual < -little && !barred(i);
    };
    int64_t n_turned = 0;
    for (int64_t rounds = 1; rounds < most; ++rounds) {
        // Each set determines the next one, so a set that comes again is in a cycle.
        const int64_t since = circle_since(turned.first(n_turned), room.odd.first(n));
        if (since < n_turned) return {false, rounds, n_turned, since};
        solve_on(system, acts, room);
        int64_t first = 0;
        while (first < n && !is_wrong(first)) ++first;
        if (first == n) return {true, rounds, n_turned, n_turned};
        turned[n_turned++] = first;
        acts[first] = !acts[first];
        for (int64_t i = 0; i < n; ++i) acts[i] = acts[i - behind[i]];
    }
    return {false, most, n_turned, 0};
}

/// Search for the released share of each leader's dependents: 1 where the leader's tension would be
/// negative, 0 where it is positive.
///
/// With shares given, the rest is a problem with a P-matrix whose solution goes continuously with
/// them; so there are shares that agree with it. They are sought for the leaders that the pivoting
/// cycled through; others keep all or nothing, as the set has it, unless their tension then
/// disagrees.
class Shares {
  public:
    Shares(const System& system, const Signs& signs, const Room& room, const Pivoted& circle)
        : system_(system),
          signs_(signs),
          room_(room),
          n_(size(system.right)),
          scale_(1.0 + largest(system.right)) {
        std::ranges::fill(is_sought_, false);
        for (int64_t t = circle.since; t < circle.n_turned; ++t) is_sought_[room_.turned[t]] = true;
        int64_t n_sought = 0;
        for (int64_t i = 0; i < n_; ++i) {
            if (signs_.behind[i] == 1) leaders_[n_leaders_++] = i - 1;
            shares_[i] = room_.acts[i] ? 1.0 : 0.0;
            // Near the active set of the shares before.
            room_.acts[i] = signs_.always[i] || system_.solution[i] > 0.0;
            none_[i] = 0;
        }
        for (int64_t leader : leaders()) n_sought += is_sought_[leader];
        if (n_sought == 0)
            for (int64_t leader : leaders()) is_sought_[leader] = true;
    }

    /// Find the shares and the solution for them; whether they exist.
    bool find() {
        while (true) {
            int64_t n = 0;
            for (int64_t leader : leaders())
                if (is_sought_[leader]) place_[n++] = shares_[leader];
            const auto place = place_.first(n);
            put_excess();
            n = 0;
            for (int64_t leader : leaders())
                if (is_sought_[leader]) place_[n++] -= excess_[leader];
            const bool found = find_zero(std::ref(*this), place, kFirstGrid, kAgreement, room_);
            take(place);
            put_excess();
            bool more = false;
            for (int64_t leader : leaders()) {
                const double left = shares_[leader] > 0.0 ? excess_[leader] : -excess_[leader];
                if (is_sought_[leader] || (found && left <= kAgreement)) continue;
                is_sought_[leader] = more = true;
            }
            if (!more) return found;
            for (int64_t leader : leaders())
                if (std::isnan(shares_[leader])) shares_[leader] = 0.0;
        }
    }
    int64_t rounds() const { return rounds_; }

    /// Zero where shares, a place cut to 0 to 1, agree with tensions, as far as it lies outside:
    /// the normal map of a variational inequality.
    void operator()(std::span<const double> place, std::span<double> value) {
        take(place);
        put_excess();
        int64_t n = 0;
        for (int64_t leader : leaders())
            if (is_sought_[leader]) {
                value[n] = excess_[leader] + place[n] - shares_[leader];
                ++n;
            }
    }

  private:
    std::span<const int64_t> leaders() const { return leaders_.first(n_leaders_); }
    void take(std::span<const double> place) {
        int64_t n = 0;
        for (int64_t leader : leaders())
            if (is_sought_[leader]) shares_[leader] = std::clamp(place[n++], 0.0, 1.0);
    }
    /// Fill in the tension of leaders where it is above zero, less their compensation where it is
    /// not; no number where there is none.
    void put_excess() {
        const auto& [matrix, right, solution] = system_;
        const Array2<double>& partly = room_.partly;
        for (int64_t i = 0; i < n_; ++i) {
            const int64_t behind = signs_.behind[i];
            const double part = behind > 0 ? shares_[i - behind] : 1.0;
            for (int64_t j = 0; j < n_; ++j) partly(i, j) = matrix(i, j) * part;
            partly(i, i) += 1.0 - part;
            right_[i] = right[i] * part;
            free_[i] = signs_.always[i] || (behind > 0 && part > 0.0);
            if (behind > 0 || free_[i]) room_.acts[i] = free_[i];
        }
        const Pivoted pivoted = pivot_from({partly, right_, solution}, {free_, none_}, room_);
        rounds_ += pivoted.rounds;
        const bool is_known = pivoted.found && ++n_evaluations_ < kMostEvaluations;
        for (int64_t leader : leaders()) {
            double left = -right[leader] - solution[leader];
            for (int64_t j = 0; j < n_; ++j) left += matrix(leader, j) * solution[j];
            excess_[leader] = is_known ? left / scale_ : std::numeric_limits<double>::quiet_NaN();
        }
    }

    const System& system_;
    const Signs& signs_;
    const Room& room_;
    int64_t n_, n_leaders_ = 0, rounds_ = 0, n_evaluations_ = 0;
    double scale_;  ///< of right-hand sides
    std::span<double> shares_ = room_.of_shares[0].first(n_), right_ = room_.of_shares[1].first(n_),
                      excess_ = room_.of_shares[2].first(n_), place_ = room_.of_shares[3].first(n_);
    std::span<int64_t> leaders_ = room_.numbers_of_leaders[0].first(n_),
                       none_ = room_.numbers_of_leaders[1].first(n_);
    std::span<bool> is_sought_ = room_.marks[0].first(n_), free_ = room_.marks[1].first(n_);
};

/// Solve by pivoting. Returns the rounds needed, which are not positive if there is no solution.
int64_t pivot(const System& system, const Signs& signs, const Room& room) {
    std::ranges::copy(signs.always, room.acts.begin());
    find_bends(system, room);
    const Pivoted pivoted = pivot_from(system, signs, room);
    if (pivoted.found) return pivoted.rounds;
    if (std::ranges::all_of(signs.behind, [](int64_t behind) { return behind == 0; }))
        return -pivoted.rounds;
    Shares shares(system, signs, room, pivoted);
    const bool found = shares.find();
    const int64_t rounds = pivoted.rounds + shares.rounds();
    return found ? rounds : -rounds;
}

}  // namespace

Found find_solution(const System& system, const Signs& signs, int64_t max_rounds,
                    const Room& room) {
    if (size(system.right) > room.k) throw std::out_of_range("a system has no room");
    const int64_t rounds = settle(system, signs, max_rounds, room);
    if (rounds > 0) return {rounds, false};
    const int64_t more = pivot(system, signs, room);
    return {more > 0 ? more - rounds : more, true};
}

}  // namespace catenary
