// A line of stations: runs of one type, and the ways of both passes through them.
#include "stations/line.hpp"

#include <algorithm>
#include <stdexcept>

#include "base/targets.hpp"

namespace catenary {

namespace {

/// Put the unknowns of a station in the order of another station type, in which each of the n has
/// this place in the given one, zero for those that it lacks.
CATENARY_FOR_TARGETS
void reorder(const int8_t* place, int64_t n, int64_t scenes, const double* given, double* found) {
    with_lanes(scenes, [&](auto lanes) __attribute__((always_inline)) {
        using All = SideBySide<lanes>;
        for (int64_t u = 0; u < n; ++u) {
            typename All::Numbers own{};
            if (place[u] >= 0) own = All::at(given + lanes * place[u]);
            All::at(found + lanes * u) = own;
        }
    });
}

/// Throws std::invalid_argument unless `numbers` hold those of each station from its one of
/// `begins` on, of which a station of type t has sizes[t].
void check_table(std::span<const int32_t> begins, std::span<const double> numbers,
                 std::span<const uint8_t> station_type, const std::vector<int64_t>& sizes) {
    for (int64_t i = 0; i < size(begins); ++i) {
        const int64_t end = begins[i] + sizes.at(station_type.empty() ? 0 : station_type[i]);
        if (begins[i] < 0 || end > size(numbers))
            throw std::invalid_argument("stations have more numbers than their blocks");
    }
}

}  // namespace

Product ProductArrays::product(const std::vector<Layout>& layouts) const {
    const int64_t n_stations = size(sections.starts);
    if (first < 0 || (n_stations > 0 && n_stations < first + size(kinds) + 1))
        throw std::invalid_argument("a product has fewer stations than rows");
    std::vector<int64_t> sizes;
    for (const Layout& layout : layouts)
        sizes.push_back((layout.is_damped ? 2 : 1) * layout.of_row() * layout.pieces().vector());
    const auto types = sections.station_type;
    check_table(kinds, blocks, types.empty() ? types : part(types, first, size(types)), sizes);
    return {.rows = {kinds.data(), blocks.data()}, .first = first, .places = sections};
}

Factored FactorArrays::factored(const std::vector<Layout>& layouts) const {
    std::vector<int64_t> inverse, besides_of_both;
    for (const Layout& layout : layouts) {
        inverse.push_back(layout.size_of(upper(layout.own)) +
                          (layout.is_sparse() ? 0 : layout.size_of(layout.own)));
        besides_of_both.push_back(2 * layout.size_of(layout.beside));
    }
    check_table(kinds, blocks, sections.station_type, inverse);
    check_table(beside_kinds, besides, sections.station_type, besides_of_both);
    return {{kinds.data(), blocks.data()}, {beside_kinds.data(), besides.data()}, sections};
}

Line::Line(std::vector<std::unique_ptr<Kernels>> kernels,
           std::vector<std::vector<int>> station_types, int scenes)
    : kernels_(std::move(kernels)), station_types_(std::move(station_types)), scenes_(scenes) {
    const size_t n = station_types_.size();
    if (n < kernels_.size()) throw std::invalid_argument("a station type is missing");
    for (const auto& one : kernels_)
        if (!one)
            throw std::invalid_argument(scenes == 1
                                            ? "no kernels take stations of these layouts"
                                            : "no kernels take several scenes of these layouts");
    place_.assign(n * n * kMostUnknowns, -1);
    for (size_t from = 0; from < n; ++from)
        for (size_t to = 0; to < n; ++to)
            for (size_t u = 0; u < station_types_[to].size(); ++u) {
                const auto& there = station_types_[from];
                const auto found = std::find(there.begin(), there.end(), station_types_[to][u]);
                if (found != there.end())
                    place_[(from * n + to) * kMostUnknowns + u] =
                        static_cast<int8_t>(found - there.begin());
            }
}

void Line::set_runs(const Work& work, int64_t n, int64_t low) {
    runs_.clear();
    run_number_.clear();
    const Sections &solved = work.factored.places, &read = work.product.places;
    const int64_t first = work.product.first;
    if (solved.starts.empty()) {
        const int64_t pitch = kernels_[0]->rows.unknowns * scenes_;
        // There is one station more to be read at both ends.
        runs_.push_back({-1, n + 1, pitch * first, 0, -pitch * low});
        n_solved_ = pitch * n;
        n_read_ = pitch * (first + n + 1);
        return;
    }
    run_number_.resize(n);
    for (int64_t begin = 0, end; begin < n; begin = end) {
        for (end = begin; end < n && solved.station_type[end] == solved.station_type[begin]; ++end)
            run_number_[end] = static_cast<int32_t>(runs_.size());
        const int64_t before = kernels_[solved.station_type[begin]]->rows.unknowns * begin;
        const int64_t here = solved.starts[begin] - before;
        const int64_t by_read = read.starts.empty() ? 0 : read.starts[first + begin] - before;
        const int64_t own = here - solved.starts[low];
        runs_.push_back({begin, end, by_read * scenes_, here * scenes_, own * scenes_});
    }
    auto end_of = [&](const Sections& places, int64_t last) {
        const size_t unknowns = station_types_.at(places.station_type[last]).size();
        return (places.starts[last] + static_cast<int64_t>(unknowns)) * scenes_;
    };
    n_solved_ = n > 0 ? end_of(solved, n - 1) : 0;
    n_read_ = read.starts.empty() ? 0 : end_of(read, first + n);
}

std::vector<uint8_t> Line::even_rows(const Work& work, int64_t n) const {
    std::vector<uint8_t> even;
    for (int64_t i = 0; i < n; ++i)
        even.push_back(kernels_[station_type(work, i)]->is_even(work.product.rows.at(i)));
    return even;
}

int64_t Line::start_of(const Work& work, int64_t station) const {
    if (work.factored.places.starts.empty()) return kernels_[0]->rows.unknowns * scenes_ * station;
    const bool is_end = station == static_cast<int64_t>(run_number_.size());
    return is_end ? n_solved_ : work.factored.places.starts[station] * scenes_;
}

void Line::reorder(int from, int to, const double* given, double* found) const {
    catenary::reorder(&place_[(from * station_types_.size() + to) * kMostUnknowns],
                      std::ssize(station_types_[to]), scenes_, given, found);
}

void Line::convert(int from, int to, Station& station) const {
    if (from == to) return;
    Station given;  // all of it takes longer to copy than what there is to convert
    std::copy_n(station.unknowns, station_types_[from].size() * scenes_, given.unknowns);
    reorder(from, to, given.unknowns, station.unknowns);
}

/// Fill in a station in the order of another station type.
void Line::outside(const Work& work, int64_t station, int station_type, Outside& found) const {
    const Product& product = work.product;
    const int64_t at = product.first + station, start = product.places.starts[at] * scenes_;
    const int there = product.places.station_type[at];
    reorder(there, station_type, product.factor + start, found.position);
    if (kernels_[station_type]->rows.is_damped)
        reorder(there, station_type, product.velocity + start, found.velocity);
}

/// Fill in displacement and velocity of the stations beside a chain for its products, where these
/// are of other station types.
void Line::put_outside(const Work& work, Chain& chain, int station_type, int step) const {
    const Run& run = *chain.run;
    if (work.right) return;
    const int64_t before = chain.first - step, after = chain.first + step * chain.n;
    chain.has_before = before < run.begin || before >= run.end;
    chain.has_after = after < run.begin || after >= run.end;
    if (chain.has_before) outside(work, before, station_type, chain.before);
    if (chain.has_after) outside(work, after, station_type, chain.after);
}

void Line::multiply(const Work& work, int64_t begin, int64_t end, double* result) const {
    Chain chain{};
    for (int64_t i = begin; i < end; i += chain.n) {
        chain.run = &run_of(i);
        chain.first = i;
        chain.n = std::min(end, chain.run->end) - i;
        put_outside(work, chain, station_type(work, i), 1);
        kernels_[station_type(work, i)]->multiply(work, chain, result + chain.run->solved);
    }
}

/// One of two chains: how far it is, and the result of the station before.
struct Line::Way {
    int step;              ///< 1 towards the end of the line, -1 towards its start
    int64_t next, left;    ///< next station, and how many are left
    int station_type = 0;  ///< that `beside` has the order of
    Station beside{};
    Chain chain{};
};

/// Begin a chain of n stations at most.
void Line::begin(Way& way, int64_t n) const {
    if (way.left == 0) return;
    const Run& run = run_of(way.next);
    const int64_t in_run = way.step > 0 ? run.end - way.next : way.next - run.begin + 1;
    way.chain.run = &run;
    way.chain.first = way.next;
    way.chain.n = std::min({n, way.left, in_run});
}

/// Take one chain, or two of equal length, forth or back.
void Line::take(const Work& work, bool forth, Way& one, Way* other) const {
    for (Way* way : {&one, other}) {
        if (!way) continue;
        const int here = station_type(work, way->next);
        convert(way->station_type, here, way->beside);
        way->station_type = here;
        way->chain.beside = &way->beside;
        if (forth) put_outside(work, way->chain, here, way->step);
    }
    const Kernels& kernels = *kernels_[one.station_type];
    Chain* const second = other ? &other->chain : nullptr;
    forth ? kernels.forth(work, one.chain, one.step, second)
          : kernels.back(work, one.chain, one.step, second);
    for (Way* way : {&one, other}) {
        if (!way) continue;
        way->next += way->step * way->chain.n;
        way->left -= way->chain.n;
    }
}

/// Take both ways on by n stations at most: side by side through runs that are alike, else the one
/// that is sooner at the end of its run, so that both fall into step.
void Line::go_on(const Work& work, bool forth, Way& a, Way& b, int64_t n) const {
    begin(a, n);
    begin(b, n);
    if (a.left > 0 && b.left > 0 && alike(station_type(work, a.next), station_type(work, b.next))) {
        a.chain.n = b.chain.n = std::min(a.chain.n, b.chain.n);
        take(work, forth, a, &b);
    } else if (b.left == 0 || (a.left > 0 && a.chain.n <= b.chain.n)) {
        take(work, forth, a, nullptr);
    } else {
        take(work, forth, b, nullptr);
    }
}

bool Line::alike(int one, int other) const {
    return one == other || (kernels_[one]->rows == kernels_[other]->rows &&
                            kernels_[one]->factors == kernels_[other]->factors);
}

/// Eliminate from both ends, and solve for the station where both chains meet.
Station Line::forth(const Work& work, int64_t begin, int64_t end, int64_t middle) const {
    Way a{1, begin, middle - begin + 1, station_type(work, begin)};
    Way b{-1, end - 1, end - 1 - middle, station_type(work, end - 1)};
    while (a.left + b.left > 0) go_on(work, true, a, b, end - begin);
    const int here = station_type(work, middle);
    convert(b.station_type, here, b.beside);
    kernels_[here]->meet(work, run_of(middle), middle, b.beside);
    return b.beside;
}

void Line::solve(const Work& work, int64_t n, int64_t middle) const {
    const Station met = forth(work, 0, n, middle);
    Way a{-1, middle - 1, middle, station_type(work, middle), met};
    Way b{1, middle + 1, n - 1 - middle, station_type(work, middle), met};
    while (a.left + b.left > 0) go_on(work, false, a, b, n);
}

void Line::step(const Work& work, const Ends& ends, int64_t stretch, Around& around) const {
    around.before();
    // They may have been moved.
    const auto [begin, end, low, high, middle] = ends;
    const Station met = forth(work, begin, end, middle);
    Way a{-1, middle - 1, middle - low, station_type(work, middle), met};
    Way b{1, middle + 1, high - 1 - middle, station_type(work, middle), met};
    const int64_t pairs = std::min(a.left, b.left);
    int64_t followed = 0;
    while (a.left + b.left > 0) {
        go_on(work, false, a, b, stretch);
        const int64_t done = std::min(middle - 1 - a.next, b.next - middle - 1);
        for (; (followed + 1) * stretch <= done && (followed + 1) * stretch < pairs; ++followed)
            around.after_stretch();
    }
    around.after_stretch();
}

}  // namespace catenary
