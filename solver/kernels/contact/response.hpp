#pragma once
// A rank's share of the small problem of a step: answers of the line to contacts and links.
#include "contact/contacts.hpp"

namespace catenary {

/// Sums over ranks besides the answers.
struct Flags {
    double rows;     ///< links with a row
    double stop;     ///< wishes to stop
    double broken;   ///< ranks that hold NaN or infinity
    double missing;  ///< links that there is no room for
};

/// Links that may switch, in a table (capacity, 2 + 3 n) for n contacts, and how contacts and they
/// act on each other.
struct LinkRows {
    Array2<double> numbers;

    int64_t capacity() const { return numbers.rows; }
    int64_t n_contacts() const { return (numbers.columns - 2) / 3; }
    /// The link's number in the line.
    int64_t number(int64_t k) const { return static_cast<int64_t>(numbers(k, 0)); }
    void put_number(int64_t k, int64_t number) const {
        numbers(k, 0) = static_cast<double>(number);
    }
    /// Its reserve without contact forces [N].
    double& reserve(int64_t k) const { return numbers(k, 1); }
    /// Increase of its reserve by a unit force at contact i [-].
    double& reaction(int64_t k, int64_t i) const { return numbers(k, 2 + i); }
    /// Decrease of height [m/N] and rate [m/(N s)] at contact i by its unit compensation.
    double& lift(int64_t k, int64_t i) const { return numbers(k, 2 + n_contacts() + i); }
    double& rise(int64_t k, int64_t i) const { return numbers(k, 2 + 2 * n_contacts() + i); }
    CATENARY_RECORD(numbers)
    CATENARY_SHAPES("m w")
};

/// Bounds of forces within which every link that switches has a row: contacts that all push up to
/// `push` (n,) and pull up to `pull` (n,) [N], 0 of contacts that only push, and compensations
/// elsewhere that take up to `loss` (1,) [N] off a reserve.
struct Bounds {
    std::span<double> push, pull, loss;
    CATENARY_RECORD(push, pull, loss)
    CATENARY_SHAPES("n, n, 1")
};

/// Share of one rank, or the sum of all ranks: `flags` (1,), `present` (n,), 1 for a contact whose
/// wire is on its strip and else 0, heights of the line, and rows of links.
struct Share {
    std::span<Flags> flags;
    std::span<double> present;
    Affine line;
    LinkRows rows;
    Bounds bounds;
    CATENARY_RECORD(flags, present, line, rows, bounds)
    CATENARY_SHAPES("1, n, n=n, w=3n+2 m=m, n=n")
};

/// Fill in a rank's share; the motion is that without forces of contacts and of links that switch.
void respond(const Contacts& contacts, const Share& share);

}  // namespace catenary
