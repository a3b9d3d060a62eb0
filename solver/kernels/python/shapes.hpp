#pragma once
// Shapes that arrays of a function or of a record must have, checked when Python gives them.
//
// A shape is written for one argument or member after the other, with commas between, and its sizes
// with spaces between, such as "n, n 3, 2n, n+1". A name is one size throughout the function or
// record: the first array that has it determines it. "n>1" is more than 1, "n.." at least n, "*"
// any size; "n 3?" may also be empty. "n=m" of a record is that its own size n is m here.
#include <pybind11/pybind11.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <stdexcept>
#include <string>
#include <string_view>

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

}  // namespace catenary::python
