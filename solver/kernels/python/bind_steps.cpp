// Python bindings of steps and their rows, of marches side by side, and of lines prepared for steps
// from outside.
#include <algorithm>

#include "ensemble/ensemble.hpp"
#include "python/from_python.hpp"
#include "simulation/simulation.hpp"
#include "tangents/tangents.hpp"

namespace catenary::python {

namespace {

/// Write steps with the inputs of the ones to come, see `PreparedLine`.
void write(const Steps& steps, const std::string& path, const py::object& ahead) {
    Kept kept;
    const StepParts& parts = steps.parts();
    if (!parts.free) throw py::value_error("these steps are taken by an ensemble");
    const TwoPasses& free = *parts.free;
    PreparedLine line{parts, free.parts(), free.tracked(), free.window(), {}, {}};
    for (const Head* head : parts.heads) line.heads.push_back(head->parts());
    line.ahead = From<Ahead>::convert(ahead, "ahead", kept);
    write_line(path, line);
}

/// Fill in points of rows (m, k), one row after another: of row i count[i] points from first[i]
/// on. A point takes the number at its one of `columns`, or zero where that is below zero.
void take_points(Array2<const double> rows, std::span<const int64_t> columns,
                 std::span<const int64_t> first, std::span<const int64_t> count,
                 std::span<double> result) {
    int64_t at = 0;
    for (int64_t i = 0; i < size(first); ++i) {
        const auto row = rows[i];
        const auto of = part(columns, first[i], first[i] + count[i]);
        std::ranges::transform(of, part(result, at, at + count[i]).begin(),
                               [row](int64_t column) { return column >= 0 ? row[column] : 0.0; });
        at += count[i];
    }
}

/// Numbers of scenes, ascending, that kernels step side by side on a line of these layouts.
std::vector<int> scenes_at_once(const std::vector<std::pair<Layout, Layout>>& layouts) {
    std::vector<int> found;
    for (const int scenes : {kScenes, kMostScenes})
        if (std::ranges::all_of(layouts, [scenes](const auto& of) {
                return kernels_for_scenes(of.first, of.second, scenes) != nullptr;
            }))
            found.push_back(scenes);
    return found;
}

/// A simulation, with arrays that are views of its numbers.
class HeldSimulation : public Simulation {
  public:
    using Simulation::Simulation;
    static bool step(HeldSimulation& simulation, int64_t n) {
        const Outcome outcome = simulation.Simulation::step(n);
        if (outcome == Outcome::kNotFound)
            throw std::runtime_error(
                "a step could not be taken, as no contact forces fit it, a kinematic contact would "
                "have to pull, or a mechanism would leave the heights that it can reach");
        if (outcome == Outcome::kTurned)
            throw std::runtime_error(
                py::str("a wire has turned by more than {:g} rad from rest, beyond its linear "
                        "model")
                    .format(simulation.most_turn()));
        return outcome == Outcome::kDone;
    }
    py::bytes saved() const {
        std::string state(state_size(), '\0');
        save(reinterpret_cast<std::byte*>(state.data()));
        return state;
    }
    void go_back(const py::bytes& saved) {
        const std::string state = saved;
        if (state.size() != state_size() ||
            !restore(reinterpret_cast<const std::byte*>(state.data())))
            throw py::value_error("this is no state of this line, or it is damaged");
    }
};

/// An array that is a view of numbers of `owner`.
template <class T>
py::array_t<std::remove_const_t<T>> view(std::span<T> numbers, const py::object& owner) {
    py::array_t<std::remove_const_t<T>> array(static_cast<py::ssize_t>(numbers.size()),
                                              numbers.data(), owner);
    if (std::is_const_v<T>) array.attr("setflags")(false);
    return array;
}
/// A property that is such an array.
template <class Numbers>
auto viewed(Numbers numbers) {
    return [numbers](const py::object& self) {
        return view(numbers(self.cast<HeldSimulation&>()), self);
    };
}
auto output(std::span<double> TrainOutputs::* which) {
    return viewed([which](HeldSimulation& simulation) {
        return std::span<const double>(simulation.outputs().*which);
    });
}

}  // namespace

void offer_steps(py::module_& module) {
    offer_records<KeptMotions, StepParts, Block, Ahead>(module);
    offer_records<ChangedRows, TangentLanes, LinkChange, HeadChange, LawChange, Tangent,
                  TangentGroup, MarchTangents>(module);
    CATENARY_OFFER_TYPE(module, "COUNTS", Counts, steps, rounds, slack, repeated, pivoted);
    py::class_<Taken>(module, "Taken")
        .def_readonly("begun", &Taken::begun)
        .def_readonly("is_full", &Taken::is_full);
    py::class_<Steps, std::shared_ptr<Steps>>(module, "Steps")
        .def(made_of<Steps, StepParts, Block>("parts", "block"))
        .def("take", &Steps::take)
        .def("write", &write);
    py::class_<LanePasses>(module, "LanePasses")
        .def(made_of<LanePasses, PassParts, int64_t>("parts", "guard"))
        .def_property_readonly("begin", &LanePasses::begin)
        .def_property_readonly("end", &LanePasses::end);
    py::class_<TangentSteps>(module, "TangentSteps")
        .def(made_of<TangentSteps, StepParts, Block, MarchTangents>("parts", "block", "tangents"))
        .def("take", &TangentSteps::take);
    offer_records<LineExtremes>(module);
    module.def("scenes_at_once", &scenes_at_once, py::arg("layouts"));
    py::class_<ScenePasses, std::shared_ptr<ScenePasses>>(module, "ScenePasses")
        .def(made_of<ScenePasses, PassParts>("parts"))
        .def("track", taking(&ScenePasses::track, "links", "rest", "reserves"))
        .def("rest", &ScenePasses::rest)
        .def("step", &ScenePasses::step);
    py::class_<Ensemble>(module, "Ensemble")
        .def(made_of<Ensemble, std::shared_ptr<ScenePasses>, LineExtremes>("passes", "extremes"))
        .def("begin", &Ensemble::begin, py::arg("lane"), py::arg("steps").none(false), py::arg("n"))
        .def("take", &Ensemble::take)
        .def("at", [](const Ensemble& own, int64_t lane) {
            return std::pair(own.at(lane).next, own.at(lane).is_left);
        });
    CATENARY_OFFER_TYPE(module, "TIE", Tie, stiffness, damping);
    PYBIND11_NUMPY_DTYPE(Input, lift_force, head_force, base, base_velocity, base_acceleration);
    py::class_<HeldSimulation>(module, "Simulation")
        .def(py::init<const std::string&>())
        .def("step", &HeldSimulation::step, py::arg("n") = 1)
        .def("set_speed", &HeldSimulation::set_speed)
        .def("save", &HeldSimulation::saved)
        .def("restore", &HeldSimulation::go_back)
        .def_property_readonly("time", &HeldSimulation::time)
        .def_property_readonly("dt", &HeldSimulation::dt)
        .def_property_readonly("way", &HeldSimulation::way)
        .def_property_readonly("speed", &HeldSimulation::speed)
        .def_property_readonly("most_speed", &HeldSimulation::most_speed)
        .def_property_readonly("n_steps_left", &HeldSimulation::n_steps_left)
        .def_property_readonly("inputs", viewed([](HeldSimulation& own) { return own.inputs(); }))
        .def_property_readonly("contact_force", output(&TrainOutputs::contact_force))
        .def_property_readonly("head_height", output(&TrainOutputs::head_height))
        .def_property_readonly("wire_height", output(&TrainOutputs::wire_height))
        .def_property_readonly("strip_force", output(&TrainOutputs::strip_force));
    offer(module, "take_points", take_points, "m k, *, m, m");
}

}  // namespace catenary::python
