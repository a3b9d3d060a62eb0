// Files of records.
#include "simulation/image.hpp"

#include <filesystem>
#include <fstream>

namespace catenary {

namespace {

constexpr size_t kPage = 4096;

/// A block as it stands in a file, before its bytes.
struct BlockHeader {
    uint64_t stood, size, changes;
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

std::vector<MemoryBlock> ImageWriter::blocks() {
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

void write_image(const std::string& path, const std::string& header, ImageWriter& writer) {
    std::ofstream file(path, std::ios::binary);
    if (!file) throw std::runtime_error("it cannot be written");
    CheckSum check;
    auto put = [&](const void* data, size_t n) {
        check.take(data, n);
        file.write(static_cast<const char*>(data), static_cast<std::streamsize>(n));
    };
    const auto blocks = writer.blocks();
    const std::string& text = writer.text();
    const uint64_t sizes[2] = {text.size(), blocks.size()};
    put(header.data(), header.size());
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

uint64_t read_image(const std::string& path, const std::string& header, std::string& text,
                    std::vector<OwnBlock>& blocks) {
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
    get_text(text, std::min(left, header.size()));
    if (!header.starts_with(text))
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
    return sum;
}

}  // namespace catenary
