// AbcFile: writes an Alembic file (Ogawa). Samples go to the file as they come; objects and properties follow
// at the end, so that memory grows by a few numbers for each sample. One thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/output_file.h"
#include "common/base/result.h"

namespace strandcast {

/// Identifies the bytes of a sample: MurmurHash3 of 128 bits (x64), seed 0, low half first.
using AbcKey = std::array<uint64_t, 2>;
AbcKey murmur_key(std::span<const std::byte> bytes);

/// Element types of Alembic that strands need, by their numbers.
enum class AbcType : uint8_t {
  Bool = 0,
  U8 = 1,
  I16 = 4,
  I32 = 6,
  U32 = 5,
  Float = 10,
  Double = 11,
  String = 12
};
enum class AbcForm : uint8_t { Compound, Scalar, Array };

/// Samples of a property that are in the file already.
struct AbcSeries {
  struct Kept {
    uint64_t child = 0;  // where it lies
    AbcKey key{};
  };
  std::vector<Kept> sample;
  uint64_t text_count = 0;  // in each sample, of an array of texts, which states it
};

struct AbcEntry {
  std::string name;
  AbcForm form = AbcForm::Compound;
  AbcType type = AbcType::U8;
  uint32_t extent = 1;
  uint32_t times = 0;  // index of its time sampling; 0 is that of what stands still
  std::string metadata;
  AbcSeries series;
  std::vector<AbcEntry> entries;  // of a compound
};

struct AbcItem {
  std::string name;
  std::string metadata;
  std::vector<AbcEntry> entries;
  std::vector<AbcItem> items;
};

struct AbcEvenTimes {
  double first_s = 0.0;
  double step_s = 1.0;
};

class AbcFile {
 public:
  static Result<AbcFile> create(const std::filesystem::path& path);

  /// Appends a sample to a series; one with the bytes of the last sample takes no space.
  Status append(AbcSeries& series, std::span<const std::byte> bytes);
  /// Writes objects, times (number 1 and up) and the description, "key=value" sorted by key. Then marks the
  /// file as finished. Returns its bytes.
  Result<uint64_t> finish(const AbcItem& top, std::string_view metadata, std::span<const AbcEvenTimes> times);

 private:
  struct Written {
    uint64_t child = 0;
    AbcKey hash{};
  };

  explicit AbcFile(OutputFile file) : file_(std::move(file)) {}
  Result<uint64_t> append_block(std::string_view bytes);
  Result<uint64_t> append_group(std::span<const uint64_t> children);
  Result<uint64_t> append_series(const AbcEntry& entry);
  Result<Written> append_compound(const std::vector<AbcEntry>& entries);
  Result<Written> append_item(const AbcItem& item);
  std::string header_of(const AbcEntry& entry);
  uint8_t metadata_index(const std::string& metadata);
  std::string times_text(std::span<const AbcEvenTimes> times) const;

  OutputFile file_;
  std::vector<std::string> indexed_metadata_;
  std::vector<uint64_t> most_samples_;  // of each time sampling
};

/// Returns numbers as bytes, as they lie in memory.
template <class T>
std::span<const std::byte> abc_bytes(const T& numbers) {
  return std::as_bytes(std::span(numbers));
}

}  // namespace strandcast
