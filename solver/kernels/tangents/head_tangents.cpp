// Derivatives of the heads' steps.
#include "tangents/head_tangents.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace catenary {

namespace {

/// Contact forces that a head's laws read; empty without laws.
std::span<double> pressed_of(const Head& head) {
    const auto& sprung = head.parts().sprung;
    return sprung && !sprung->laws.law.empty() ? sprung->laws.pressed : std::span<double>{};
}

/// By how much a state is changed to differentiate a step: heights and their rates little beside
/// the bends of tables, and much beside round-off.
constexpr double kMoved[] = {1e-4, 1e-2, 1.0}, kDriven = 1.0;
/// Factor of a smaller change, for laws that bend by more than the part `kBent` in between; a
/// change below `kNearest` is taken in any case.
constexpr double kNearer = 1e-2, kBent = 1e-5, kNearest = 1e-3;

}  // namespace

HeadTangents::HeadTangents(std::vector<Head*> heads, std::vector<std::vector<Head*>> pairs,
                           std::span<const double> force)
    : heads_(std::move(heads)), pairs_(std::move(pairs)), force_(force) {
    if (pairs_.size() != heads_.size())
        throw std::invalid_argument("tangents have pairs of other heads than the steps");
    for (size_t h = 0; h < n(); ++h) {
        const Head& head = *heads_[h];
        if (!head.parts().linear && pairs_[h].size() != 2)
            throw std::invalid_argument("a head is no linear chain and has no pair");
        pressed_.emplace_back(pressed_of(head).size());
        row_.resize(std::max<size_t>(row_.size(), kDrive + 2 * head.n_strips()));
        before_.emplace_back(3 * head.n());
        free_.emplace_back(3 * head.n());
    }
}

void HeadTangents::keep() {
    for (size_t h = 0; h < n(); ++h) {
        std::ranges::copy(heads_[h]->arrays().state, before_[h].begin());
        if (!pressed_[h].empty()) std::ranges::copy(pressed_of(*heads_[h]), pressed_[h].begin());
    }
}

void HeadTangents::predict(std::span<const HeadChange> changes, const Array2<double>& drives,
                           const Array2<const double>& changed, const GapChange& gaps) {
    for (size_t h = 0; h < n(); ++h) {
        const std::span<const double> drive = drives[h];
        std::span<const double> own;
        if (changed.rows > 0) own = changed[h];
        if (!heads_[h]->parts().linear) {
            step_beside(changes[h], drive, own, h, gaps);
            continue;
        }
        const Drive none{};
        step_chain(changes[h], *reinterpret_cast<const Drive*>(drive.data()),
                   own.empty() ? none : *reinterpret_cast<const Drive*>(own.data()), h, gaps);
    }
}

void HeadTangents::move(std::span<const HeadChange> changes, std::span<const double> forces) const {
    for (size_t h = 0; h < n(); ++h) {
        const Head& head = *heads_[h];
        const auto state = changes[h].state;
        const auto answers = head.answers();
        for (int64_t i = 0; i < answers.rows; ++i) {
            state[i] = free_[h][i];
            for (int64_t j = 0; j < answers.columns; ++j)
                state[i] -= answers(i, j) * forces[head.first() + j];
        }
    }
}

double HeadTangents::height(size_t h, const HeadChange& change) const {
    const Head& head = *heads_[h];
    const auto& touch = head.arrays().touch;
    double sum = 0.0;
    for (int64_t j = 0; j < head.n_strips(); ++j)
        for (int64_t k = 0; k < head.n(); ++k) sum += touch(0, j, k) * change.state[k];
    return sum / static_cast<double>(head.n_strips());
}

/// Differentiate the step of a linear chain.
void HeadTangents::step_chain(const HeadChange& change, const Drive& drive, const Drive& changed,
                              size_t h, const GapChange& gaps) {
    const Head& chain = *heads_[h];
    const LinearStep& step = *chain.parts().linear;
    const HeadArrays& arrays = chain.arrays();
    const NewmarkFactors& newmark = arrays.newmark;
    const int64_t n = chain.n(), s = chain.n_strips(), first = chain.first();
    const bool changes = change.matrix.rows > 0;
    std::vector<double>& free = free_[h];
    for (int64_t i = 0; i < 3 * n; ++i) {
        double value = changed.force * step.by_drive[i] + changed.head_air * step.by_head[i];
        for (int64_t k = 0; k < 3 * n; ++k) value += step.matrix(i, k) * change.state[k];
        if (changes) {
            value += drive.force * change.by_drive[i] + drive.head_air * change.by_head[i];
            for (int64_t k = 0; k < 3 * n; ++k) value += change.matrix(i, k) * before_[h][k];
        }
        free[i] = value;
    }
    // The answer of the state to a force changes with the masses.
    for (int64_t j = 0; changes && j < s; ++j)
        for (int64_t i = 0; i < n; ++i) {
            double answer = 0.0;
            for (int64_t k = 0; k < n; ++k) answer += change.inverse(i, k) * arrays.touch(0, j, k);
            answer *= force_[first + j];
            free[i] -= newmark.position * answer;
            free[n + i] -= newmark.velocity * answer;
            free[2 * n + i] -= answer;
        }
    add_places(free, h, 1.0, gaps);
}

/// Add the heights and rates of the strips by a head's state, or by a part of it.
void HeadTangents::add_places(std::span<const double> state, size_t h, double weight,
                              const GapChange& gaps) const {
    const Head& head = *heads_[h];
    const auto& touch = head.arrays().touch;
    const int64_t n = head.n(), first = head.first();
    for (int64_t j = 0; j < head.n_strips(); ++j)
        for (int64_t k = 0; k < n; ++k) {
            gaps.place[first + j] += weight * touch(0, j, k) * state[k];
            gaps.rate[first + j] +=
                weight * (touch(0, j, k) * state[n + k] + touch(1, j, k) * state[k]);
        }
}

/// Differentiate the step of another head by steps of heads like it: by its state, its drive and
/// the parameter.
void HeadTangents::step_beside(const HeadChange& change, std::span<const double> drive,
                               std::span<const double> changed, size_t h, const GapChange& gaps) {
    const int64_t n = heads_[h]->n();
    const auto row = std::span(row_).first(kDrive + 2 * heads_[h]->n_strips());
    std::ranges::fill(free_[h], 0.0);
    double largest = 0.0;
    for (int64_t i = 0; i < 3 * n; ++i)
        largest = std::max(largest, std::abs(change.state[i]) / kMoved[i / n]);
    for (size_t i = 0; i < row.size() && !changed.empty(); ++i)
        largest = std::max(largest, std::abs(changed[i]) / kDriven);
    // Nearer still where a law bends in between.
    for (double by = 1.0; largest > 0.0; by *= kNearer) {
        const double step = by / largest;
        for (int side = 0; side < 2; ++side) {
            const double sign = side == 0 ? step : -step;
            Head& head = *pairs_[h][side];
            put_state(head, h);
            for (int64_t i = 0; i < 3 * n; ++i) head.arrays().state[i] += sign * change.state[i];
            for (size_t i = 0; i < row.size(); ++i)
                row[i] = drive[i] + (changed.empty() ? 0.0 : sign * changed[i]);
            take_step(head, row, h);
        }
        if (by < kNearest || is_straight(h)) {
            for (int side = 0; side < 2; ++side)
                add_end(*pairs_[h][side], h, (side == 0 ? 0.5 : -0.5) / step, gaps);
            break;
        }
    }
    for (size_t side = 0; side < change.beside.size(); ++side) {
        put_state(*change.beside[side], h);
        take_step(*change.beside[side], drive.first(row.size()), h);
        add_end(*change.beside[side], h, (side == 0 ? -0.5 : 0.5) / change.step, gaps);
    }
}

void HeadTangents::put_state(Head& head, size_t h) const {
    std::ranges::copy(before_[h], head.arrays().state.begin());
    if (!pressed_[h].empty()) std::ranges::copy(pressed_[h], pressed_of(head).begin());
}

/// Take a step with the forces that were found.
void HeadTangents::take_step(Head& head, std::span<const double> drive, size_t h) const {
    const int64_t first = heads_[h]->first();
    head.step(drive);
    head.advance(part(force_, first, first + head.n_strips()));
}

/// Whether the ends of a pair's steps are to both sides of that of the head, as of a smooth law.
bool HeadTangents::is_straight(size_t h) const {
    const auto here = heads_[h]->arrays().state;
    const auto one = pairs_[h][0]->arrays().state, other = pairs_[h][1]->arrays().state;
    const int64_t n = heads_[h]->n();
    double bent = 0.0, moved = 0.0;
    for (int64_t i = 0; i < 3 * n; ++i) {
        bent = std::max(bent, std::abs(one[i] + other[i] - 2.0 * here[i]) / kMoved[i / n]);
        moved = std::max(moved, std::abs(one[i] - other[i]) / kMoved[i / n]);
    }
    return bent <= kBent * moved;
}

/// Add the end of a step to derivatives with a weight.
void HeadTangents::add_end(const Head& head, size_t h, double weight, const GapChange& gaps) {
    const auto state = head.arrays().state;
    for (size_t i = 0; i < state.size(); ++i) free_[h][i] += weight * state[i];
    add_places(state, h, weight, gaps);
}

}  // namespace catenary
