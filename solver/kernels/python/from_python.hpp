#pragma once
// Functions over arrays and records, as Python calls them.
//
// An array is taken as it is, never copied; a record is any object with attributes of its members'
// names. A kernel can be bound to its first arguments: a call then converts the others only.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/arrays.hpp"

namespace catenary::python {

namespace py = pybind11;

/// Owners of the memory that arrays and records point to, kept alive.
using Kept = std::vector<py::object>;

// Error messages are made here once, not in each function that is offered: they were most of
// the compiled code.

[[gnu::noinline]] inline std::string numbered(size_t i, const std::string& function) {
    return "argument " + std::to_string(i + 1) + " of " + function;
}
[[noreturn, gnu::noinline]] inline void refuse_type(py::handle given, const std::string& name) {
    throw py::type_error(name +
                         " has the wrong type: " + std::string(py::str(py::type::of(given))));
}
/// The given array if it has so many dimensions; `type_of` is the type that its numbers must have.
[[gnu::noinline]] inline py::array array_of(py::handle given, bool is_of_type,
                                            py::dtype (*type_of)(), const std::string& name,
                                            int n_dimensions, Kept& kept) {
    if (!py::isinstance<py::array>(given)) throw py::type_error(name + " is no array");
    if (!is_of_type)
        throw py::type_error(name + " is no contiguous array of " +
                             std::string(py::str(type_of())));
    auto array = py::reinterpret_borrow<py::array>(given);
    if (array.ndim() != n_dimensions)
        throw py::value_error(name + " has " + std::to_string(array.ndim()) + " dimensions, not " +
                              std::to_string(n_dimensions));
    kept.push_back(array);
    return array;
}

/// Numbers of an array with so many dimensions.
template <class T>
T* numbers_of(py::handle given, const std::string& name, int n_dimensions, Kept& kept) {
    using Number = std::remove_const_t<T>;
    const bool is_of_type = py::isinstance<py::array_t<Number, py::array::c_style>>(given);
    py::array array = array_of(given, is_of_type, &py::dtype::of<Number>, name, n_dimensions, kept);
    if constexpr (std::is_const_v<T>)
        return static_cast<T*>(array.data());
    else
        return static_cast<T*>(array.mutable_data());  // refuses arrays that are read only
}

/// A value of a record whose names are listed.
struct Member {
    py::object value;
    std::string name;
};
/// The value of the first of some names. Takes this name off them.
[[gnu::noinline]] inline Member next_member(py::handle record, std::string_view& names,
                                            const std::string& name) {
    const size_t end = std::min(names.find(','), names.size());
    const std::string own(names.substr(0, end));
    names.remove_prefix(std::min(end + 2, names.size()));
    return {record.attr(own.c_str()), name + "." + own};
}

template <class T>
concept Record = requires(T record) {
    T::kMembers;
    record.members();
};

/// Conversion of a Python value to a T; `name` is its name in error messages.
template <class T>
struct From {
    static T convert(py::handle given, const std::string& name, Kept& kept) {
        if constexpr (Record<T>) {
            T record{};
            std::string_view names = T::kMembers;
            auto put = [&]<class M>(M& member) {
                const Member own = next_member(given, names, name);
                member = From<M>::convert(own.value, own.name, kept);
            };
            std::apply([&](auto&... member) { (put(member), ...); }, record.members());
            return record;
        } else {
            try {
                return py::cast<T>(given);
            } catch (const py::cast_error&) {
                refuse_type(given, name);
            }
        }
    }
};
template <class T>
struct From<std::span<T>> {
    static std::span<T> convert(py::handle given, const std::string& name, Kept& kept) {
        T* numbers = numbers_of<T>(given, name, 1, kept);
        return {numbers, static_cast<size_t>(py::reinterpret_borrow<py::array>(given).size())};
    }
};
template <class T>
struct From<Array2<T>> {
    static Array2<T> convert(py::handle given, const std::string& name, Kept& kept) {
        T* numbers = numbers_of<T>(given, name, 2, kept);
        auto array = py::reinterpret_borrow<py::array>(given);
        return {numbers, array.shape(0), array.shape(1)};
    }
};
template <class T>
struct From<Array3<T>> {
    static Array3<T> convert(py::handle given, const std::string& name, Kept& kept) {
        T* numbers = numbers_of<T>(given, name, 3, kept);
        auto array = py::reinterpret_borrow<py::array>(given);
        return {numbers, array.shape(0), array.shape(1), array.shape(2)};
    }
};
template <class T>
struct From<Array4<T>> {
    static Array4<T> convert(py::handle given, const std::string& name, Kept& kept) {
        T* numbers = numbers_of<T>(given, name, 4, kept);
        auto array = py::reinterpret_borrow<py::array>(given);
        return {numbers, array.shape(0), array.shape(1), array.shape(2), array.shape(3)};
    }
};
/// An object of a bound class, which is kept alive.
template <class T>
struct From<T*> {
    static T* convert(py::handle given, const std::string& name, Kept& kept) {
        if (given.is_none()) return nullptr;
        kept.push_back(py::reinterpret_borrow<py::object>(given));
        return From<std::reference_wrapper<T>>::convert(given, name, kept);
    }
};
template <class T>
struct From<std::reference_wrapper<T>> {
    static T* convert(py::handle given, const std::string& name, Kept&) {
        if (!py::isinstance<T>(given)) refuse_type(given, name);
        return given.cast<T*>();
    }
};
template <class T>
struct From<std::optional<T>> {
    static std::optional<T> convert(py::handle given, const std::string& name, Kept& kept) {
        if (given.is_none()) return std::nullopt;
        return From<T>::convert(given, name, kept);
    }
};
template <class T>
struct From<std::vector<T>> {
    static std::vector<T> convert(py::handle given, const std::string& name, Kept& kept) {
        std::vector<T> found;
        for (py::handle one : py::cast<py::sequence>(given))
            found.push_back(
                From<T>::convert(one, name + "[" + std::to_string(found.size()) + "]", kept));
        return found;
    }
};

/// A function with some of its arguments.
class Bound {
  public:
    virtual ~Bound() = default;
    virtual py::object call(const py::args& later) = 0;
};

/// A function over arrays and records.
class Kernel {
  public:
    virtual ~Kernel() = default;
    virtual std::unique_ptr<Bound> bound(const py::args& first) const = 0;
    py::object call(const py::args& given) const { return bound(given)->call(py::args()); }
    std::string name, does;
};

template <class R, class... A>
class BoundFunction : public Bound {
  public:
    BoundFunction(R (*function)(A...), const std::string& name, const py::args& first)
        : function_(function), name_(name), n_bound_(first.size()) {
        if (n_bound_ > sizeof...(A)) throw py::type_error(too_many(n_bound_));
        convert(first, 0, kept_, std::index_sequence_for<A...>());
    }
    py::object call(const py::args& later) override {
        if (n_bound_ + later.size() != sizeof...(A))
            throw py::type_error(too_many(n_bound_ + later.size()));
        Kept kept;
        convert(later, n_bound_, kept, std::index_sequence_for<A...>());
        auto run = [&](auto&... value) -> R { return function_(*value...); };
        if constexpr (std::is_void_v<R>) {
            std::apply(run, values_);
            return py::none();
        } else if constexpr (std::is_base_of_v<py::object, R>) {
            return std::apply(run, values_);
        } else {
            return py::cast(std::apply(run, values_));
        }
    }

  private:
    /// Convert the given values, the arguments from `begin` on.
    template <size_t... I>
    void convert(const py::args& given, size_t begin, Kept& kept, std::index_sequence<I...>) {
        (..., (I >= begin && I < begin + given.size()
                   ? (void)std::get<I>(values_).emplace(
                         From<std::decay_t<A>>::convert(given[I - begin], numbered(I, name_), kept))
                   : (void)0));
    }
    std::string too_many(size_t n) const {
        return name_ + " takes " + std::to_string(sizeof...(A)) + " arguments, not " +
               std::to_string(n);
    }

    R (*function_)(A...);
    std::string name_;
    size_t n_bound_;
    std::tuple<std::optional<std::decay_t<A>>...> values_;
    Kept kept_;
};

template <class R, class... A>
class FunctionKernel : public Kernel {
  public:
    explicit FunctionKernel(R (*function)(A...)) : function_(function) {}
    std::unique_ptr<Bound> bound(const py::args& first) const override {
        return std::make_unique<BoundFunction<R, A...>>(function_, name, first);
    }

  private:
    R (*function_)(A...);
};

/// Let a module offer a function as a kernel; `does` is its docstring, one sentence.
template <class R, class... A>
void offer(py::module_& module, const char* name, R (*function)(A...), const char* does) {
    auto kernel = std::make_unique<FunctionKernel<R, A...>>(function);
    kernel->name = name;
    kernel->does = does;
    module.attr(name) = py::cast(std::unique_ptr<Kernel>(std::move(kernel)));
}

}  // namespace catenary::python
