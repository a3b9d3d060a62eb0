// Python bindings of steps, their rows and errors, and of lines prepared for steps from outside.
#include "python/pass_parts.hpp"
#include "schemes/step_error.hpp"
#include "simulation/simulation.hpp"
#include "tangents/tangents.hpp"
#include "views/extremes.hpp"

namespace catenary::python {

namespace {

/// Steps that keep their arrays alive.
class HeldSteps : public Steps {
  public:
    HeldSteps(const py::object& parts, const py::object& block, Kept kept = {})
        : Steps(From<StepParts>::convert(parts, "parts", kept),
                From<Block>::convert(block, "block", kept)),
          kept_(std::move(kept)) {}

    /// Write them with the inputs of the steps to come, see `PreparedLine`.
    void write(const std::string& path, const py::object& ahead) const {
        Kept kept;
        const auto given = From<Ahead>::convert(ahead, "ahead", kept);
        const TwoPasses& free = *parts().free;
        PreparedLine line{};
        line.steps = parts();
        line.passes = free.parts();
        line.tracked = free.tracked();
        line.window = free.window();
        for (const Head* head : parts().heads) line.heads.push_back(parts_of(*head));
        line.ahead = given;
        write_line(path, line);
    }

  private:
    Kept kept_;
};

/// Free steps of tangents that keep their arrays alive.
class HeldLanePasses : public LanePasses {
  public:
    HeldLanePasses(PassParts parts, int64_t guard, Kept kept)
        : LanePasses(std::move(parts), guard), kept_(std::move(kept)) {}
    static std::unique_ptr<HeldLanePasses> made(const std::vector<Layout>& rows,
                                                const std::vector<Layout>& factors,
                                                const py::object& parts, int64_t guard) {
        Kept kept;
        PassParts found = pass_parts(rows, factors, parts, kept);
        return std::make_unique<HeldLanePasses>(std::move(found), guard, std::move(kept));
    }

  private:
    Kept kept_;
};

/// Steps with tangents that keep their arrays alive.
class HeldTangentSteps : public TangentSteps {
  public:
    HeldTangentSteps(const py::object& parts, const py::object& block, const py::object& tangents,
                     Kept kept = {})
        : TangentSteps(From<StepParts>::convert(parts, "parts", kept),
                       From<Block>::convert(block, "block", kept),
                       From<MarchTangents>::convert(tangents, "tangents", kept)),
          kept_(std::move(kept)) {}

  private:
    Kept kept_;
};

/// A simulation, with arrays that are views of its numbers.
class HeldSimulation : public Simulation {
  public:
    using Simulation::Simulation;
    static bool step(HeldSimulation& simulation, int64_t n) {
        const Outcome outcome = simulation.Simulation::step(n);
        if (outcome == Outcome::kNotFound)
            throw std::runtime_error("the forces of a step could not be found");
        return outcome == Outcome::kDone;
    }
    py::bytes saved() const {
        std::string state(state_size(), '\0');
        save(reinterpret_cast<std::byte*>(state.data()));
        return state;
    }
    void go_back(const std::string& state) {
        if (state.size() != state_size()) throw py::value_error("this is no state of this line");
        restore(reinterpret_cast<const std::byte*>(state.data()));
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
    CATENARY_OFFER_TYPE(module, "COUNTS", Counts, steps, rounds, slack, repeated, pivoted);
    py::class_<Taken>(module, "Taken")
        .def_readonly("begun", &Taken::begun)
        .def_readonly("is_full", &Taken::is_full);
    py::class_<Steps>(module, "BlockSteps");
    py::class_<HeldSteps, Steps>(module, "Steps")
        .def(py::init([](const py::object& parts, const py::object& block) {
            return std::make_unique<HeldSteps>(parts, block);
        }))
        .def("take",
             [](HeldSteps& steps, int64_t first, int64_t end) { return steps.take(first, end); })
        .def("write", &HeldSteps::write);
    py::class_<LanePasses>(module, "LaneSteps")
        .def_property_readonly("begin", &LanePasses::begin)
        .def_property_readonly("end", &LanePasses::end);
    py::class_<HeldLanePasses, LanePasses>(module, "LanePasses")
        .def(py::init(&HeldLanePasses::made));
    py::class_<HeldTangentSteps>(module, "TangentSteps")
        .def(py::init(
            [](const py::object& parts, const py::object& block, const py::object& tangents) {
                return std::make_unique<HeldTangentSteps>(parts, block, tangents);
            }))
        .def("take", [](HeldTangentSteps& steps, int64_t first, int64_t end) {
            return steps.take(first, end);
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
        .def_property_readonly("n_steps_left", &HeldSimulation::n_steps_left)
        .def_property_readonly("inputs", viewed([](HeldSimulation& own) { return own.inputs(); }))
        .def_property_readonly("contact_force", output(&TrainOutputs::contact_force))
        .def_property_readonly("head_height", output(&TrainOutputs::head_height))
        .def_property_readonly("wire_height", output(&TrainOutputs::wire_height))
        .def_property_readonly("strip_force", output(&TrainOutputs::strip_force));

    offer(module, "step_error", step_error, "n=n, n=n");
    offer(module, "accept_step", accept_step, "n=n, n=n");

    offer(module, "take_extremes", take_extremes, "m k, *, *, *, 2 n");
    offer(module, "take_points", take_points, "m k, *, m, m");
}

}  // namespace catenary::python
