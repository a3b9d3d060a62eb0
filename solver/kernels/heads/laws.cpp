// Laws that are not linear.
#include "heads/laws.hpp"

#include <algorithm>
#include <stdexcept>

namespace catenary {

namespace {

/// Segments of tables mostly settle in two rounds; a cycle of segments is left after so many.
constexpr int kMostRounds = 20;

/// The part of a law's variable that is not the head's: of base, roof and where it counts from.
double outside(const HeadLaw& law, const StepStart& start) {
    return law.of_rate ? law.by_base * start.base_velocity + law.by_roof * start.roof_velocity
                       : law.by_base * start.base + law.by_roof * start.roof - law.zero;
}

}  // namespace

SettlingLaws::SettlingLaws(const HeadLaws& laws, int64_t n)
    : laws_(laws),
      plain_force_(n),
      plain_matrix_(n * n),
      acceleration_(n),
      segment_(laws.law.size()) {
    for (const HeadLaw& law : laws.law)
        if (law.begin < 0 || law.end < law.begin + 2 || law.end > size(laws.points))
            throw std::invalid_argument("a law has two points at least");
}

/// Find the segments in which laws are with the accelerations at hand; whether one has changed.
bool SettlingLaws::find_segments(const StepStart& start, const NewmarkFactors& newmark) {
    bool changed = false;
    for (int64_t j = 0; j < size(laws_.law); ++j) {
        const HeadLaw& law = laws_.law[j];
        const auto way = laws_.ways[j];
        double at = outside(law, start);
        for (int64_t i = 0; i < size(way); ++i)
            at += way[i] * (law.of_rate ? start.velocity[i] + newmark.velocity * acceleration_[i]
                                        : start.position[i] + newmark.position * acceleration_[i]);
        int64_t k = law.begin;
        while (k < law.end - 2 && laws_.points[k + 1].at <= at) ++k;
        changed = changed || k != segment_[j];
        segment_[j] = k;
    }
    return changed;
}

/// Add a law along its segment.
void SettlingLaws::add(int64_t number, const StepStart& start, const NewmarkFactors& newmark,
                       std::span<double> force, Array2<double> matrix) const {
    const HeadLaw& law = laws_.law[number];
    const auto way = laws_.ways[number];
    const int64_t n = size(way);
    const HeadLawPoint &low = laws_.points[segment_[number]],
                       &high = laws_.points[segment_[number] + 1];
    const double slope = (high.force - low.force) / (high.at - low.at);
    const double factor = law.of_rate ? newmark.velocity : newmark.position;
    const auto predicted = law.of_rate ? start.velocity : start.position;
    double at = outside(law, start);
    for (int64_t i = 0; i < n; ++i) at += way[i] * predicted[i];
    const double pull = low.force + slope * (at - low.at);
    for (int64_t i = 0; i < n; ++i) {
        if (way[i] == 0.0) continue;
        force[i] -= way[i] * pull;
        for (int64_t k = 0; k < n; ++k) matrix(i, k) += factor * slope * way[i] * way[k];
    }
}

void SettlingLaws::settle(const StepStart& start, const NewmarkFactors& newmark,
                          std::span<double> force, Array2<double> matrix) {
    const int64_t n = size(force);
    std::ranges::copy(force, plain_force_.begin());
    std::ranges::copy(matrix.all(), plain_matrix_.begin());
    std::ranges::copy(start.acceleration, acceleration_.begin());
    std::ranges::fill(segment_, -1);
    for (int round = 0; round < kMostRounds; ++round) {
        if (!find_segments(start, newmark)) return;
        std::ranges::copy(plain_force_, force.begin());
        std::ranges::copy(plain_matrix_, matrix.all().begin());
        for (int64_t j = 0; j < size(laws_.law); ++j) add(j, start, newmark, force, matrix);
        invert(matrix);
        for (int64_t i = 0; i < n; ++i) {
            double value = 0.0;
            for (int64_t k = 0; k < n; ++k) {
                double push = force[k];
                for (int64_t j = 0; j < size(laws_.pressed); ++j)
                    push -= start.touch(j, k) * laws_.pressed[j];
                value += matrix(i, k) * push;
            }
            acceleration_[i] = value;
        }
    }
}

}  // namespace catenary
