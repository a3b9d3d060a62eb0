#pragma once
// Records with all arrays that they point to, as a file.
//
// Arrays that share memory still share it when read: overlapping ones are kept as one block of
// bytes, with the address where it stood, and a record's array by its own. Blocks stand in memory
// where they stood, modulo pages of 4096 bytes, as arrays that are walked through side by side are
// placed for the caches.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "base/arrays.hpp"

namespace catenary {

/// FNV-1a, by words of eight bytes: it detects damaged bytes, not forged ones.
class CheckSum {
  public:
    void take(const void* data, size_t n);
    uint64_t sum() const { return sum_; }

  private:
    void put(uint64_t word) { sum_ = (sum_ ^ word) * 0x100000001b3u; }
    uint64_t sum_ = 0xcbf29ce484222325u;
};

/// Pass all members of a value to a visitor: `bytes(T&)` for plain values, `array(T*&, n)` for
/// arrays of n numbers, and `count(size_t&)` for lengths, upon which a reader resizes. Pointers to
/// objects are left out.
template <class Visitor, class T>
void visit(Visitor& visitor, T& value) {
    auto visit_all = [&](auto&... own) { (visit(visitor, own), ...); };
    if constexpr (RecordType<T>) {
        std::apply(visit_all, value.members());
    } else if constexpr (TableType<T>) {
        std::apply([&](auto&... size) { (visitor.bytes(size), ...); }, value.sizes());
        visitor.array(value.data, value.all().size());
    } else if constexpr (requires { value.subspan(0); }) {
        size_t n = value.size();
        visitor.count(n);
        auto* data = value.data();
        visitor.array(data, n);
        value = {data, n};
    } else if constexpr (requires { value.resize(0); }) {
        size_t n = value.size();
        visitor.count(n);
        value.resize(n);
        for (auto& one : value) visit(visitor, one);
    } else if constexpr (requires { value.has_value(); }) {
        size_t n = value.has_value();
        visitor.count(n);
        if (n && !value) value.emplace();
        if (n) visit(visitor, *value);
    } else if constexpr (requires { value.second; }) {
        visit_all(value.first, value.second);
    } else if constexpr (!std::is_pointer_v<T>) {
        static_assert(std::is_trivially_copyable_v<T>);
        visitor.bytes(value);
    }
}

/// A part of memory that arrays share.
struct MemoryBlock {
    uintptr_t begin, end;
    bool changes;  ///< whether any array in it is written
};

/// Writer of a record's members as bytes, with arrays as where they stand in memory.
class ImageWriter {
  public:
    template <class T>
    void bytes(T& value) {
        text_.append(reinterpret_cast<const char*>(&value), sizeof(T));
    }
    void count(size_t& n) { bytes(n); }
    template <class T>
    void array(T*& data, size_t n) {
        if (n == 0) return;
        bytes(data);
        const auto begin = reinterpret_cast<uintptr_t>(data);
        found_.push_back({begin, begin + n * sizeof(T), !std::is_const_v<T>});
    }
    const std::string& text() const { return text_; }
    /// Blocks of all arrays, in the order of memory.
    std::vector<MemoryBlock> blocks();

  private:
    std::string text_;
    std::vector<MemoryBlock> found_;
};

/// A block that was read, in memory of its own, and where it stood when it was written.
struct OwnBlock {
    uintptr_t stood;
    std::unique_ptr<std::byte[]> memory;
    std::span<std::byte> bytes;
    bool changes;
};

/// Fills in a record from such bytes. Throws std::runtime_error where they end too early or point
/// out of blocks.
class ImageReader {
  public:
    ImageReader(std::string text, std::vector<OwnBlock>& blocks)
        : text_(std::move(text)), blocks_(blocks) {}
    template <class T>
    void bytes(T& value) {
        if (sizeof(T) > text_.size() - at_) throw std::runtime_error("it ends too early");
        std::memcpy(static_cast<void*>(&value), &text_[at_], sizeof(T));
        at_ += sizeof(T);
    }
    void count(size_t& n) {
        bytes(n);
        if (n > (size_t{1} << 40)) throw std::runtime_error("a length in it is impossible");
    }
    template <class T>
    void array(T*& data, size_t n) {
        data = nullptr;
        if (n == 0) return;
        uintptr_t stood;
        bytes(stood);
        const auto next = std::ranges::upper_bound(blocks_, stood, {}, &OwnBlock::stood);
        if (next == blocks_.begin()) throw std::runtime_error("an array in it has no block");
        const OwnBlock& block = *(next - 1);
        const size_t begin = stood - block.stood, size = block.bytes.size();
        if (begin > size || n > (size - begin) / sizeof(T))
            throw std::runtime_error("an array in it is beyond its block");
        data = reinterpret_cast<T*>(block.bytes.data() + begin);
    }

  private:
    std::string text_;
    size_t at_ = 0;
    std::vector<OwnBlock>& blocks_;
};

/// Write a file with a header of one line, and what was written of a record with its blocks. Throws
/// std::runtime_error if it cannot be written.
void write_image(const std::string& path, const std::string& header, ImageWriter& writer);
/// Read such a file, which begins with this header; fills in the bytes of the record and the
/// blocks, and returns the file's checksum. Throws std::runtime_error if it cannot be read, has
/// another header, or was damaged.
uint64_t read_image(const std::string& path, const std::string& header, std::string& text,
                    std::vector<OwnBlock>& blocks);

/// Write a record.
template <class T>
void write_record(const std::string& path, const std::string& header, T& record) {
    ImageWriter writer;
    visit(writer, record);
    write_image(path, header, writer);
}
/// Read it, with the memory of its arrays; returns the checksum of the file.
template <class T>
uint64_t read_record(const std::string& path, const std::string& header, T& record,
                     std::vector<OwnBlock>& blocks) {
    std::string text;
    const uint64_t sum = read_image(path, header, text, blocks);
    ImageReader reader(std::move(text), blocks);
    visit(reader, record);
    return sum;
}

}  // namespace catenary
