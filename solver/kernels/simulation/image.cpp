// Files of records.
#include "simulation/image.hpp"

#include <filesystem>
#include <fstream>

namespace catenary {

namespace {

constexpr size_t kPage = 4096;

class FileOutput {
  public:
    explicit FileOutput(const std::string& path) : file_(path, std::ios::binary) {
        if (!file_) throw std::runtime_error("it cannot be written");
    }
    void put(const void* data, size_t n) {
        check_.take(data, n);
        file_.write(static_cast<const char*>(data), static_cast<std::streamsize>(n));
        if (!file_) throw std::runtime_error("it cannot be written to its end");
    }
    void end() {
        const uint64_t sum = check_.sum();
        put(&sum, sizeof sum);
        if (!file_.flush()) throw std::runtime_error("it cannot be written to its end");
    }

  private:
    std::ofstream file_;
    CheckSum check_;
};

class FileInput {
  public:
    explicit FileInput(const std::string& path) {
        std::error_code unknown;
        if (!std::filesystem::is_regular_file(path, unknown))
            throw std::runtime_error("there is no such file");
        file_.open(path, std::ios::binary);
        if (!file_) throw std::runtime_error("it cannot be read");
        left_ = std::filesystem::file_size(path);
    }
    void get(void* data, size_t n) {
        if (n > left_ || !file_.read(static_cast<char*>(data), static_cast<std::streamsize>(n)))
            throw std::runtime_error("it ends too early");
        left_ -= n;
        check_.take(data, n);
    }
    size_t left() const { return left_; }
    /// Returns the sum of what was read.
    uint64_t end() {
        const uint64_t expected = check_.sum();
        uint64_t sum;
        get(&sum, sizeof sum);
        if (sum != expected) throw std::runtime_error("it is damaged");
        return sum;
    }

  private:
    std::ifstream file_;
    CheckSum check_;
    size_t left_ = 0;
};

/// A block as it stands in a file, before its bytes.
struct BlockHeader {
    uint64_t size, place_in_page, changes;
};

}  // namespace

void CheckSum::take(const void* data, size_t n) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (; n >= 8; n -= 8, bytes += 8) {
        uint64_t word;
        std::memcpy(&word, bytes, 8);
        put(word);
    }
    for (; n > 0; --n) put(*bytes++);
}

std::vector<MemoryBlock> BlockFinder::blocks() {
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

void write_image(const std::string& path, const std::string& header, const std::string& text,
                 const std::vector<MemoryBlock>& blocks) {
    FileOutput output(path);
    output.put(header.data(), header.size());
    const uint64_t sizes[2] = {text.size(), blocks.size()};
    output.put(sizes, sizeof sizes);
    output.put(text.data(), text.size());
    for (const MemoryBlock& block : blocks) {
        const BlockHeader own{block.end - block.begin, block.begin % kPage, block.changes};
        output.put(&own, sizeof own);
        output.put(reinterpret_cast<const void*>(block.begin), own.size);
    }
    output.end();
}

ImageText read_image(const std::string& path, const std::string& header,
                     std::vector<OwnBlock>& blocks) {
    FileInput input(path);
    std::string found(header.size(), '\0');
    if (input.left() < header.size()) throw std::runtime_error("it ends too early");
    input.get(found.data(), found.size());
    if (found != header)
        throw std::runtime_error("it is no prepared line of this version of Catenary");
    uint64_t sizes[2];
    input.get(sizes, sizeof sizes);
    if (sizes[0] > input.left() || sizes[1] > input.left() / sizeof(BlockHeader))
        throw std::runtime_error("it ends too early");
    std::string text(sizes[0], '\0');
    input.get(text.data(), text.size());
    for (uint64_t k = 0; k < sizes[1]; ++k) {
        BlockHeader own;
        input.get(&own, sizeof own);
        if (own.size > input.left() || own.place_in_page >= kPage)
            throw std::runtime_error("it ends too early");
        auto memory = std::make_unique<std::byte[]>(own.size + 2 * kPage);
        const auto start = reinterpret_cast<uintptr_t>(memory.get());
        const size_t page = (kPage - start % kPage) % kPage;
        std::byte* bytes = memory.get() + page + own.place_in_page;
        input.get(bytes, own.size);
        blocks.push_back({std::move(memory), {bytes, own.size}, own.changes != 0});
    }
    const uint64_t sum = input.end();
    return {std::move(text), sum};
}

}  // namespace catenary
