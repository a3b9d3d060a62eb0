// Block elimination of a line, each kind of factor worked out once.
#include "stations/elimination.hpp"

#include <algorithm>

#include "base/targets.hpp"

// Factors are the same if they are so bit for bit. How many there are is not to depend on whether a
// processor adds products without rounding.
#if defined(__clang__)
#pragma clang fp contract(off)
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

namespace catenary {

namespace {

/// Parts of a factor: S^-1 and -S^-1 B.
enum Part { kInverse, kCarried, kParts };

/// Factors that there is room for at first.
constexpr int64_t kRoom = 1024;

using Matrix = Array2<double>;
using Given = Array2<const double>;

void copy(Given from, Matrix to) {
    std::copy(from.all().begin(), from.all().end(), to.all().begin());
}

/// Add to `pivot` the Schur complement's term of an eliminated station beside it: the product of
/// the `block` that joins both with the other's `carried`, -S^-1 B.
CATENARY_FOR_TARGETS
void condense(Given block, Given carried, Matrix pivot, std::span<double> row) {
    const int64_t n = pivot.rows;
    double* const total = row.data();
    for (int64_t i = 0; i < n; ++i) {
        for (int64_t j = 0; j < n; ++j) total[j] = 0.0;
        for (int64_t k = 0; k < n; ++k) {
            const double factor = block.data[i * n + k];
            const double* const other = carried.data + k * n;
            for (int64_t j = 0; j < n; ++j) total[j] += factor * other[j];
        }
        double* const into = pivot.data + i * n;
        for (int64_t j = 0; j < n; ++j) into[j] += total[j];
    }
}

/// Fill in `carried`, -S^-1 B, by which a station's unknowns follow from the station beyond.
CATENARY_FOR_TARGETS
void carry(Given inverse, Given block, Matrix carried) {
    const int64_t n = inverse.rows;
    for (int64_t i = 0; i < n; ++i) {
        double* const into = carried.data + i * n;
        for (int64_t j = 0; j < n; ++j) into[j] = 0.0;
        for (int64_t k = 0; k < n; ++k) {
            const double factor = inverse.data[i * n + k];
            const double* const other = block.data + k * n;
            for (int64_t j = 0; j < n; ++j) into[j] -= factor * other[j];
        }
    }
}

CATENARY_FOR_TARGETS
void invert_pivot(Matrix pivot) {
    invert(pivot);
}

/// Factors by number, found again by the factor before and the kind of the station.
class Known {
  public:
    Known(int64_t width, int64_t n_kinds, int64_t n)
        : width_(width), latest_(n_kinds, -1), row_(width) {
        numbers_.reserve(std::min(n, kRoom) * each());
    }

    /// The factor of a station of this kind after one with the factor `last`, -1 if it is the
    /// first.
    int32_t after(int32_t last, int32_t kind, const StationBlocks& blocks, bool from_end) {
        for (int32_t at = first_entry_[last + 1]; at >= 0; at = entries_[at].next)
            if (entries_[at].kind == kind) return entries_[at].factor;
        const int32_t found = made(last, kind, blocks, from_end);
        entries_.push_back({kind, found, first_entry_[last + 1]});
        first_entry_[last + 1] = static_cast<int32_t>(entries_.size()) - 1;
        return found;
    }
    /// Numbers and kinds of all.
    void give(Eliminated& into) {
        numbers_.resize(kinds_.size() * each());
        into.factors = std::move(numbers_);
        into.kinds = std::move(kinds_);
    }

  private:
    struct Entry {
        int32_t kind, factor, next;
    };

    size_t each() const { return kParts * width_ * width_; }
    Matrix part(int64_t factor, int64_t number) {
        return {numbers_.data() + factor * each() + number * width_ * width_, width_, width_};
    }
    /// A new factor, or the same that is there already.
    int32_t made(int32_t last, int32_t kind, const StationBlocks& blocks, bool from_end) {
        const auto& before = from_end ? blocks.after : blocks.before;
        const auto& onward = from_end ? blocks.before : blocks.after;
        const auto count = static_cast<int32_t>(kinds_.size());
        numbers_.resize(std::max(numbers_.size(), (count + 1) * each()));
        const Matrix pivot = part(count, kInverse);
        copy(blocks.own[kind], pivot);
        if (last >= 0) condense(before[kind], part(last, kCarried), pivot, row_);
        invert_pivot(pivot);
        carry(pivot, onward[kind], part(count, kCarried));
        const size_t compared = kParts * width_ * width_;
        const double* const own = pivot.data;
        for (int32_t other = latest_[kind]; other >= 0; other = alike_[other])
            if (std::equal(own, own + compared, part(other, kInverse).data)) return other;
        kinds_.push_back(kind);
        alike_.push_back(latest_[kind]);
        latest_[kind] = count;
        first_entry_.push_back(-1);
        return count;
    }

    int64_t width_;
    std::vector<double> numbers_;              // of factors, with room for one that is tried
    std::vector<int32_t> kinds_, alike_;       // of each factor: its kind, and the one found before
    std::vector<int32_t> latest_;              // factor of each kind
    std::vector<Entry> entries_;               // followers of each factor
    std::vector<int32_t> first_entry_ = {-1};  // of none, and then of each factor
    std::vector<double> row_;
};

}  // namespace

Eliminated eliminate(std::span<const int32_t> kinds, const StationBlocks& blocks, bool from_end) {
    const int64_t n = size(kinds);
    Eliminated found;
    found.numbers.resize(n);
    Known known(blocks.own.rows, blocks.own.n, n);
    int32_t last = -1;
    for (int64_t step = 0; step < n; ++step) {
        const int64_t i = from_end ? n - 1 - step : step;
        last = known.after(last, kinds[i], blocks, from_end);
        found.numbers[i] = last;
    }
    known.give(found);
    return found;
}

void join(std::span<const Meeting> meetings, const StationBlocks& blocks,
          Array3<const double> before, Array3<const double> after, Array3<double> factors) {
    auto carried = [](const auto& of, int64_t factor) { return of[kParts * factor + kCarried]; };
    std::vector<double> row(blocks.own.rows);
    for (int64_t i = 0; i < size(meetings); ++i) {
        const Meeting& meeting = meetings[i];
        const Matrix pivot = factors[kParts * i + kInverse];
        copy(blocks.own[meeting.kind], pivot);
        if (meeting.before >= 0)
            condense(blocks.before[meeting.kind], carried(before, meeting.before), pivot, row);
        if (meeting.after >= 0)
            condense(blocks.after[meeting.kind], carried(after, meeting.after), pivot, row);
        invert_pivot(pivot);
    }
}

int64_t middle_of(int64_t low, int64_t high) {
    return (low + high) / 2 / kMiddles * kMiddles;
}

void turn(std::span<int32_t> kinds, const Turning& turning, int64_t before, int64_t middle) {
    part(kinds, std::min(before, middle), std::max(before, middle) + 1);
    part(turning.to_end, 0, size(kinds));
    part(turning.here, middle / kMiddles, middle / kMiddles + 1);
    for (int64_t i = before; i < middle; ++i) kinds[i] = turning.to_end[i];
    for (int64_t i = middle + 1; i <= before; ++i) kinds[i] = turning.to_start[i];
    kinds[middle] = turning.here[middle / kMiddles];
}

}  // namespace catenary
