#pragma once
// Functions over arrays and records, as Python calls them.
//
// An array is taken as it is, never copied; a record is any object with attributes of its members'
// names. A kernel can be bound to its first arguments: a call then converts the others only.
//
// Shapes that arrays of a function or of a record must have are checked when Python gives them.
// A shape is written for one argument or member after the other, with commas between, and its sizes
// with spaces between, such as "n, n 3, 2n, n+1". A name is one size throughout the function or
// record: the first array that has it determines it. "n>1" is more than 1, "n.." at least n, "*"
// any size; "n 3?" may also be empty. "n=m" of a record is that its own size n is m here.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "base/arrays.hpp"

namespace catenary::python {

namespace py = pybind11;

/// Take the next word off a text, and what separates it from the others.
inline std::string_view next_word(std::string_view& text, char separator) {
    const std::string_view word = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
    return word;
}
/// Take the number off that a text begins with; `other` if it begins with none.
inline int64_t next_number(std::string_view& text, int64_t other) {
    const char* end = std::from_chars(text.data(), text.data() + text.size(), other).ptr;
    text.remove_prefix(end - text.data());
    return other;
}

/// Sizes of a function or record by their names.
class Sizes {
  public:
    /// The size of a name, -1 as long as none is known.
    int64_t of(std::string_view name) const {
        for (size_t k = 0; k < n_; ++k)
            if (known_[k].first == name) return known_[k].second;
        return -1;
    }
    /// Whether a size is that of a term, such as 3, n, 2n, n-1, n>1 or n..; makes its name known.
    bool fits(std::string_view term, int64_t size) {
        if (term == "*") return true;
        if (term.size() == 1 && term[0] >= 'a') {  // of most arrays
            const int64_t known = of(term);
            if (known < 0) known_.at(n_++) = {term, size};
            return known < 0 || known == size;
        }
        const bool is_least = term.ends_with("..");
        if (is_least) term.remove_suffix(2);
        const int64_t factor = next_number(term, 1);
        if (term.empty()) return is_least ? size >= factor : size == factor;
        const auto name = term.substr(0, term.find_first_of("+->"));
        term.remove_prefix(name.size());
        const char sign = term.empty() ? '+' : term.front();
        if (!term.empty()) term.remove_prefix(1);
        const int64_t number = next_number(term, 0);
        if (sign == '>' && size <= number) return false;
        const int64_t left = sign == '>' ? size : size - (sign == '-' ? -number : number);
        if (left < 0 || (left % factor && !is_least)) return false;
        const int64_t value = left / factor, known = of(name);
        if (known >= 0) return is_least ? value >= known : value == known;
        if (!is_least) known_.at(n_++) = {name, value};
        return true;
    }
    /// How many names are known, and the first n of them with their sizes, for people.
    size_t n() const { return n_; }
    std::string text(size_t n) const {
        std::string found;
        for (size_t k = 0; k < n; ++k)
            found += (k ? ", " : ", with ") + std::string(known_[k].first) + " = " +
                     std::to_string(known_[k].second);
        return found;
    }

  private:
    std::array<std::pair<std::string_view, int64_t>, 12> known_;
    size_t n_ = 0;
};

/// Refuse an array unless its shape is the wanted one.
[[gnu::noinline]] inline void check_array(std::span<const int64_t> shape, std::string_view wanted,
                                          const std::string& name, Sizes& sizes) {
    if (wanted.empty() || wanted == "*") return;
    std::string_view terms = wanted;
    const bool may_be_empty = terms.ends_with('?');
    if (may_be_empty) {
        if (std::ranges::count(shape, 0)) return;
        terms.remove_suffix(1);
    }
    const size_t n_before = sizes.n();
    bool fits = true;
    for (const int64_t size : shape) fits &= sizes.fits(next_word(terms, ' '), size);
    if (fits) return;
    std::string given;
    for (const int64_t size : shape) given += (given.empty() ? "" : " ") + std::to_string(size);
    throw py::value_error(name + " has the shape (" + given + "), not (" + std::string(wanted) +
                          ")" + sizes.text(n_before));
}
/// Refuse a record unless its `own` sizes are the wanted ones.
[[gnu::noinline]] inline void check_record(const Sizes& own, std::string_view wanted,
                                           const std::string& name, Sizes& sizes) {
    if (wanted == "*") return;
    while (!wanted.empty()) {
        std::string_view term = next_word(wanted, ' ');
        const bool may_be_empty = term.ends_with('?');
        if (may_be_empty) term.remove_suffix(1);
        const std::string_view of = next_word(term, '=');
        const int64_t size = own.of(of);
        if (size < 0 || (may_be_empty && size == 0)) continue;
        const size_t n_before = sizes.n();
        if (!sizes.fits(term, size))
            throw py::value_error(name + " has " + std::string(of) + " = " + std::to_string(size) +
                                  ", not " + std::string(term) + sizes.text(n_before));
    }
}

/// Owners of the memory that arrays and records point to, kept alive.
struct Kept : std::vector<py::object> {
    Sizes sizes;  ///< of the record that was converted last
};

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

/// Sizes of an array.
template <class T>
std::array<int64_t, 1> shape_of(std::span<T> array) {
    return {size(array)};
}
template <TableType T>
auto shape_of(T array) {
    return std::apply([](auto... size) { return std::array{size...}; }, array.sizes());
}

/// Refuse a value of a function or record with these sizes unless it has the wanted shape; `own`
/// are the sizes of the record that was converted last.
template <class T>
void check_shape(const T& value, std::string_view wanted, const std::string& name, Sizes& sizes,
                 const Sizes& own) {
    if constexpr (requires { shape_of(value); })
        check_array(shape_of(value), wanted, name, sizes);
    else if constexpr (RecordType<T>)
        check_record(own, wanted, name, sizes);
    else if constexpr (requires { value.has_value(); })
        if (value) check_shape(*value, wanted, name, sizes, own);
}

/// Conversion of a Python value to a T; `name` is its name in error messages.
template <class T>
struct From {
    static T convert(py::handle given, const std::string& name, Kept& kept) {
        if constexpr (RecordType<T>) {
            T record{};
            std::string_view names = T::kMembers, shapes;
            if constexpr (requires { T::kShapes; }) shapes = T::kShapes;
            Sizes sizes;
            auto put = [&]<class M>(M& member) {
                const Member own = next_member(given, names, name);
                member = From<M>::convert(own.value, own.name, kept);
                check_shape(member, next_word(shapes, ','), own.name, sizes, kept.sizes);
            };
            std::apply([&](auto&... member) { (put(member), ...); }, record.members());
            kept.sizes = sizes;
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
/// An array of N dimensions, over numbers of type T.
template <class Array, class T, size_t N>
struct FromArray {
    static Array convert(py::handle given, const std::string& name, Kept& kept) {
        T* const numbers = numbers_of<T>(given, name, N, kept);
        const auto array = py::reinterpret_borrow<py::array>(given);
        return [&]<size_t... I>(std::index_sequence<I...>) {
            return Array{numbers, static_cast<Size>(array.shape(I))...};
        }(std::make_index_sequence<N>());
    }
    using Size = std::conditional_t<N == 1, size_t, int64_t>;
};
template <class T>
struct From<std::span<T>> : FromArray<std::span<T>, T, 1> {};
template <TableType T>
struct From<T> : FromArray<T, std::remove_pointer_t<decltype(T::data)>,
                           std::tuple_size_v<decltype(T().sizes())>> {};
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

/// Offer the type of an array's numbers in a module, a struct with these members.
#define CATENARY_OFFER_TYPE(module, name, type, ...) \
    PYBIND11_NUMPY_DTYPE(type, __VA_ARGS__);         \
    module.attr(name) = py::dtype::of<type>()

/// Offer records in a module: named tuples of the members of these structs, which tell what they
/// are.
template <RecordType... T>
void offer_records(py::module_& module) {
    const py::object make = py::module_::import("collections").attr("namedtuple");
    auto offer_one = [&](std::string name, const char* members) {
        name.erase(0, name.rfind(':') + 1);
        module.attr(name.c_str()) =
            make(name, members, py::arg("module") = module.attr("__name__"));
    };
    (offer_one(py::type_id<T>(), T::kMembers), ...);
}

/// At least `n` numbers that a call reads or fills.
template <class T>
std::span<T> numbers(const py::object& given, const char* name, int64_t n) {
    Kept kept;
    const auto found = From<std::span<T>>::convert(given, name, kept);
    if (size(found) < n) throw py::value_error(std::string(name) + " has too few numbers");
    return found;
}

/// What keeps alive the owners of arrays.
struct Keeper {
    Kept kept;
};
/// An object that keeps alive the arrays that it was made of.
template <class Model>
class Held : public Model, public Keeper {
  public:
    template <class... Parts>
    explicit Held(Kept&& owners, Parts&&... parts)
        : Model(std::forward<Parts>(parts)...), Keeper{std::move(owners)} {}
};

/// What Python gives for a value of any type.
template <class>
using Given = py::object;
/// Constructor of a class from such parts, whose `names` stand in error messages.
template <class Model, class... Parts>
auto made_of(std::convertible_to<const char*> auto... names) {
    return py::init([=](const Given<Parts>&... given) -> std::unique_ptr<Model> {
        Kept kept;
        std::tuple<Parts...> parts{From<Parts>::convert(given, names, kept)...};
        auto make = [&](auto&... part) -> std::unique_ptr<Model> {
            return std::make_unique<Held<Model>>(std::move(kept), std::move(part)...);
        };
        return std::apply(make, parts);
    });
}
/// A method of a class made so that takes further parts, whose arrays it keeps alive as well.
template <class Model, class... Parts>
auto taking(void (Model::*take)(Parts...), std::convertible_to<const char*> auto... names) {
    return [=](Model& model, const Given<Parts>&... given) {
        Kept& kept = dynamic_cast<Keeper&>(model).kept;
        (model.*take)(From<std::decay_t<Parts>>::convert(given, names, kept)...);
    };
}

/// A function with some of its arguments.
struct Bound {
    std::function<py::object(const py::args&)> call;  ///< with the others
};

/// A function over arrays and records.
struct Kernel {
    std::string name;
    const char* shapes;  ///< of the arguments not owned
    std::function<Bound(const Kernel&, const py::args&)> bind;

    Bound bound(const py::args& first) const { return bind(*this, first); }
    py::object call(const py::args& given) const { return bound(given).call(py::args()); }
};

template <class R, class... A>
class BoundFunction {
  public:
    BoundFunction(R (*function)(A...), const Kernel& of, const py::args& first)
        : function_(function), name_(of.name), shapes_(of.shapes), n_bound_(first.size()) {
        if (n_bound_ > sizeof...(A)) throw py::type_error(too_many(n_bound_));
        convert(first, 0, kept_, sizes_, std::index_sequence_for<A...>());
    }
    py::object call(const py::args& later) {
        if (n_bound_ + later.size() != sizeof...(A))
            throw py::type_error(too_many(n_bound_ + later.size()));
        Kept kept;
        Sizes sizes = sizes_;
        convert(later, n_bound_, kept, sizes, std::index_sequence_for<A...>());
        auto run = [&](auto&... value) -> R { return function_(*value...); };
        if constexpr (std::is_void_v<R>) {
            std::apply(run, values_);
            return py::none();
        } else if constexpr (std::is_base_of_v<py::object, R>) {
            return std::apply(run, values_);
        } else if constexpr (RecordType<R>) {
            R found = std::apply(run, values_);
            return py::cast(found.members());
        } else {
            return py::cast(std::apply(run, values_));
        }
    }

  private:
    /// Convert the given values, the arguments from `begin` on.
    template <size_t... I>
    void convert(const py::args& given, size_t begin, Kept& kept, Sizes& sizes,
                 std::index_sequence<I...>) {
        std::string_view shapes = shapes_;
        auto put = [&]<class Value>(std::optional<Value>& value, size_t i) {
            const std::string_view shape = next_word(shapes, ',');
            if (i < begin || i >= begin + given.size()) return;
            const std::string name = numbered(i, name_);
            value.emplace(From<Value>::convert(given[i - begin], name, kept));
            check_shape(*value, shape, name, sizes, kept.sizes);
        };
        (..., put(std::get<I>(values_), I));
    }
    std::string too_many(size_t n) const {
        return name_ + " takes " + std::to_string(sizeof...(A)) + " arguments, not " +
               std::to_string(n);
    }

    R (*function_)(A...);
    std::string name_;
    std::string_view shapes_;
    size_t n_bound_;
    Sizes sizes_;
    std::tuple<std::optional<std::decay_t<A>>...> values_;
    Kept kept_;
};

/// Offer a function in a module as a kernel whose arguments have these `shapes`.
template <class R, class... A>
void offer(py::module_& module, const char* name, R (*function)(A...), const char* shapes) {
    auto bind = [function](const Kernel& of, const py::args& first) -> Bound {
        auto own = std::make_shared<BoundFunction<R, A...>>(function, of, first);
        return {[own](const py::args& later) { return own->call(later); }};
    };
    module.attr(name) = Kernel{name, shapes, bind};
}

}  // namespace catenary::python
