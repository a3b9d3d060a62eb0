// Merrill's path of simplices, grid after grid.
#include "contact_problem/simplicial_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "contact_problem/active_set.hpp"

namespace catenary {

namespace {

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
        : of_(of),
          start_(start),
          width_(width),
          n_(size(start)),
          columns_(room.path.columns),
          room_(room),
          origin_(room.path.numbers[0].first(n_)),
          zero_(room.path.numbers[1].first(n_ + 1)),
          entering_(room.path.numbers[2].first(n_ + 1)),
          weights_(room.path.numbers[3].first(n_ + 1)),
          change_(room.path.numbers[4].first(n_ + 1)),
          place_(room.path.numbers[5].first(n_)),
          order_(room.path.counts[0].first(n_ + 1)),
          first_(room.path.counts[1].first(n_ + 1)),
          corner_(room.path.counts[2].first(n_ + 1)),
          held_(room.path.counts[3].first(n_ + 1)),
          all_(part(room.path.all, 0, n_ + 1)) {
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

    const Map& of_;
    std::span<const double> start_;
    double width_;
    int64_t n_;
    Array2<double> columns_;
    const Room& room_;
    std::span<double> origin_, zero_, entering_, weights_, change_, place_;
    std::span<int64_t> order_, first_, corner_, held_;
    std::span<bool> all_;
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

}  // namespace catenary
