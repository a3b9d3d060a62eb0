// Files of prepared lines: a record with all arrays that it points to.
//
// Arrays that share memory still share it when read: overlapping ones are kept as one block of
// bytes, with the address where it stood, and a record's array by its own. Blocks stand in memory
// where they stood, modulo pages of 4096 bytes, as arrays that are walked through side by side are
// placed for the caches.
#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <type_traits>

#include "simulation/simulation.hpp"

namespace catenary {

namespace {

constexpr size_t kPage = 4096;

/// A block as it stands in a file, before its bytes.
struct BlockHeader {
    uint64_t stood, size, changes;
};

/// The first line of a file, which names the version of its form: all names of members are in it,
/// so that a file of another form is refused.
std::string header() {
    auto names = std::string("Catenary prepared line 1: ") + PreparedLine::kMembers + "; ";
    names += std::string(Ahead::kMembers) + "; " + StepParts::kMembers + "; " +
             PassParts::kMembers + "; " + Contacts::kMembers + "; " + SmallProblem::kMembers +
             "; " + HeadParts::kMembers + "; " + Window::kMembers + "; ";
    for (size_t bytes : {sizeof(PreparedLine), sizeof(StepParts), sizeof(Touch), sizeof(Node),
                         sizeof(Layout), sizeof(HeadParts)})
        names += std::to_string(bytes) + " ";
    return names + "\n";
}

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
class Writer {
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
    std::vector<MemoryBlock> blocks() {
        std::ranges::sort(found_, {}, &MemoryBlock::begin);
        std::vector<MemoryBlock> merged;
        for (const MemoryBlock& one : found_) {
            if (merged.empty() || one.begin >= merged.back().end) {
                merged.push_back(one);
            } else {
                merged.back().end = std::max(merged.back().end, one.end);
                merged.back().changes |= one.changes;
            }
        }
        return merged;
    }

  private:
    std::string text_;
    std::vector<MemoryBlock> found_;
};

/// Fills in a record from such bytes. Throws std::runtime_error where they end too early or point
/// out of blocks.
class Reader {
  public:
    Reader(std::string text, std::vector<OwnBlock>& blocks)
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

}  // namespace

void CheckSum::take(const void* data, size_t n) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    auto put = [this](uint64_t word) { sum_ = (sum_ ^ word) * 0x100000001b3u; };
    for (; n >= 8; n -= 8, bytes += 8) {
        uint64_t word;
        std::memcpy(&word, bytes, 8);
        put(word);
    }
    for (; n > 0; --n) put(*bytes++);
}

void write_line(const std::string& path, PreparedLine& line) {
    std::ofstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("it cannot be written");
    CheckSum check;
    auto put = [&](const void* data, size_t n) {
        check.take(data, n);
        file.write(static_cast<const char*>(data), static_cast<std::streamsize>(n));
    };
    Writer writer;
    visit(writer, line);
    const auto blocks = writer.blocks();
    const std::string& text = writer.text();
    const uint64_t sizes[2] = {text.size(), blocks.size()};
    const std::string first_line = header();
    put(first_line.data(), first_line.size());
    put(sizes, sizeof sizes);
    put(text.data(), text.size());
    for (const MemoryBlock& block : blocks) {
        const BlockHeader own{block.begin, block.end - block.begin, block.changes};
        put(&own, sizeof own);
        put(reinterpret_cast<const void*>(block.begin), own.size);
    }
    const uint64_t sum = check.sum();
    put(&sum, sizeof sum);
    if (!file.flush()) throw std::runtime_error("it cannot be written to its end");
}

uint64_t read_line(const std::string& path, PreparedLine& line, std::vector<OwnBlock>& blocks) {
    std::error_code unknown;
    if (!std::filesystem::is_regular_file(path, unknown))
        throw std::runtime_error("there is no such file");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("it cannot be read");
    size_t left = std::filesystem::file_size(path);
    CheckSum check;
    auto get = [&](void* data, size_t n) {
        if (n > left || !file.read(static_cast<char*>(data), static_cast<std::streamsize>(n)))
            throw std::runtime_error("it ends too early");
        left -= n;
        check.take(data, n);
    };
    auto get_text = [&](std::string& into, size_t n) {
        if (n > left) throw std::runtime_error("it ends too early");
        into.resize(n);
        get(into.data(), n);
    };
    const std::string first_line = header();
    std::string text;
    get_text(text, std::min(left, first_line.size()));
    if (!first_line.starts_with(text))
        throw std::runtime_error("it is no prepared line of this version of Catenary");
    uint64_t sizes[2];
    get(sizes, sizeof sizes);
    get_text(text, sizes[0]);
    for (uint64_t k = 0; k < sizes[1]; ++k) {
        BlockHeader own;
        get(&own, sizeof own);
        if (own.size > left) throw std::runtime_error("it ends too early");
        auto memory = std::make_unique<std::byte[]>(own.size + 2 * kPage);
        const auto start = reinterpret_cast<uintptr_t>(memory.get());
        const size_t page = (kPage - start % kPage) % kPage;
        std::byte* bytes = memory.get() + page + own.stood % kPage;
        get(bytes, own.size);
        blocks.push_back({own.stood, std::move(memory), {bytes, own.size}, own.changes != 0});
    }
    const uint64_t expected = check.sum();
    uint64_t sum;
    get(&sum, sizeof sum);
    if (sum != expected) throw std::runtime_error("it is damaged");
    Reader reader(std::move(text), blocks);
    visit(reader, line);
    return sum;
}

}  // namespace catenary
