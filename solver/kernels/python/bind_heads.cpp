// Python bindings of pantographs: heads, and multibody systems.
#include "heads/head.hpp"
#include "multibody/bodies.hpp"
#include "python/from_python.hpp"

namespace catenary::python {

namespace {

/// A head whose steps are calls of Python, with no coordinates of its own.
class CalledHead : public Head {
  public:
    CalledHead(const HeadArrays& arrays, py::object predict)
        : Head(arrays), predict_(std::move(predict)) {}

  protected:
    bool step_free(const Drive& drive) override {
        predict_(drive.time);
        return true;
    }

  private:
    py::object predict_;
};

void then(Head& head, py::object after) {
    head.then([after = std::move(after)](double time, std::span<const double> force) {
        after(time, py::array_t<double>(static_cast<py::ssize_t>(force.size()), force.data()));
    });
}

std::span<const double> row(const Head& head, const py::object& drive) {
    return numbers<const double>(drive, "drive", kDrive + 2 * head.n_strips());
}

void extrapolate(Head& head, const py::object& drive, const py::object& early) {
    Kept kept;
    const auto table = From<Array2<double>>::convert(early, "early", kept);
    if (table.rows != 2 || table.columns != head.n_strips())
        throw py::value_error("early has other strips than its head");
    head.extrapolate(row(head, drive), table);
}

}  // namespace

void offer_heads(py::module_& module) {
    offer_records<SplineTables, NewmarkFactors, HeadArrays, Bending, Lowering, Regulation, HeadLaws,
                  LinearStep, SprungMasses, ReducedMechanism, HeadParts>(module);
    CATENARY_OFFER_TYPE(module, "DRIVE", Drive, time, force, part, base, base_velocity,
                        base_acceleration, roof, roof_velocity, head_air, arm_air, bodies_air);
    CATENARY_OFFER_TYPE(module, "HEAD_LAW", HeadLaw, by_base, by_roof, zero, of_rate, begin, end);
    CATENARY_OFFER_TYPE(module, "HEAD_LAW_POINT", HeadLawPoint, at, force);
    CATENARY_OFFER_TYPE(module, "REGULATION", RegulationSettings, of_height, target, part, dt,
                        sample, least, most);
    CATENARY_OFFER_TYPE(module, "CONTROL_GAINS", ControlGains, measured, of_error, of_integral,
                        of_rate);
    CATENARY_OFFER_TYPE(module, "REGULATION_MEMORY", RegulationMemory, time, next, filtered,
                        integral, error, samples, acting);
    CATENARY_OFFER_TYPE(module, "LOWERING_MEMORY", LoweringMemory, height, caught_at, phase);
    py::class_<Head>(module, "Head")
        .def(made_of<Head, HeadParts>("parts"))
        .def_property_readonly("height", &Head::height)
        .def_property("first", &Head::first, &Head::set_first)
        .def_property("added_force", &Head::added_force, &Head::set_added_force)
        .def("bend", taking(&Head::bend, "bending"))
        .def("then", &then)
        .def("lower", taking(&Head::lower, "lowering"))
        .def("regulate", taking(&Head::regulate, "regulation"))
        .def("step",
             [](Head& head, const py::object& drive) { return head.step(row(head, drive)); })
        .def("advance",
             [](Head& head, const py::object& contact_force) {
                 head.advance(
                     numbers<const double>(contact_force, "contact_force", head.n_strips()));
             })
        .def("extrapolate", &extrapolate);
    py::class_<CalledHead, Head>(module, "CalledHead")
        .def(made_of<CalledHead, HeadArrays, py::object>("arrays", "predict"));

    CATENARY_OFFER_TYPE(module, "BODY_PRODUCT", BodyProduct, body, start, end, between, normal,
                        at_start, at_end);
    CATENARY_OFFER_TYPE(module, "BODY_LINE", BodyLine, i, j, at_i, at_j);
    offer(module, "rotation_matrices", rotation_matrices, "n 4, n 3 3");
    offer(module, "move_bodies", move_bodies, "n+1 3, n+1 4, 6n");
    offer(module, "add_gyroscopic_moments", add_gyroscopic_moments, "6n, n 3, n+1 3");
    offer(module, "body_products", body_products, "n=n, m, m=m n=n");
    offer(module, "body_lines", body_lines, "n=n, m, m=m n=n");
    offer(module, "independent_rows", independent_rows, "");
}

}  // namespace catenary::python
