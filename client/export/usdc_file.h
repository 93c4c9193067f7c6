// UsdcFile: writes a binary USD file ("crate", version 0.8), alone or as the one member of a package (.usdz).
// Values go to the file as they come; prims and properties follow at the end, so that memory grows by a few
// numbers for each sample. One thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/output_file.h"
#include "common/groom/usdc_coding.h"

namespace strandcast {

/// The root, a prim, an attribute or a relationship, with values by their names and what is in it.
struct UsdcItem {
  std::string name;
  UsdcKind kind = UsdcKind::Attribute;
  std::vector<std::pair<std::string, UsdcValue>> fields;
  std::vector<UsdcItem> items;

  /// Returns how many items these are, with this one.
  uint32_t count() const {
    uint32_t all = 1;
    for (const UsdcItem& item : items) all += item.count();
    return all;
  }
};

class UsdcFile {
 public:
  static Result<UsdcFile> create(const std::filesystem::path& path);

  UsdcValue token(const std::string& text);
  UsdcValue string(const std::string& text);
  Result<UsdcValue> number(double value);
  /// Appends numbers as they lie in memory, as an array of `count` values.
  Result<UsdcValue> array(UsdcType type, size_t count, std::span<const std::byte> bytes);
  /// Appends whole numbers, packed.
  Result<UsdcValue> ints(std::span<const int32_t> numbers);
  /// Appends an array of strings.
  Result<UsdcValue> strings(std::span<const std::string> texts);
  /// Appends a list of tokens: of a prim's children or properties.
  Result<UsdcValue> tokens(std::span<const std::string> texts);
  /// Appends an edit that puts tokens in front of a list.
  Result<UsdcValue> prepended_tokens(std::span<const std::string> texts);
  /// Appends the one target of a relationship, by its number among all items, parents first.
  Result<UsdcValue> target(uint32_t item);
  /// Appends values of some times.
  Result<UsdcValue> samples(std::span<const double> times, std::span<const UsdcValue> values);
  /// Writes the root with all that is in it, and marks the file as finished. Returns its bytes.
  Result<uint64_t> finish(UsdcItem root);

 private:
  struct Section {
    std::string_view name;
    uint64_t begin = 0, size_bytes = 0;
  };

  UsdcFile(OutputFile file, std::string member) : file_(std::move(file)), member_(std::move(member)) {}
  uint64_t at() const { return file_.size_bytes() - begin_; }
  Status append(std::string_view bytes);
  Result<uint64_t> append_aligned(std::string_view bytes);
  Status append_item(UsdcItem item, bool has_sibling);
  Status append_section(std::string_view name, const std::string& bytes);
  Status append_sections();
  Status begin_package();
  Status finish_package(uint32_t crc);
  std::string member_header(uint32_t crc, uint32_t size_bytes) const;

  OutputFile file_;
  std::string member_;  // of a package; empty: there is none
  uint64_t begin_ = 0;  // of the crate in the file
  uint32_t crc_ = 0;    // of what follows the header
  std::vector<std::string> tokens_;
  std::map<std::string, uint32_t, std::less<>> token_index_;
  std::vector<uint32_t> strings_;
  std::vector<int32_t> field_names_, field_sets_;
  std::vector<UsdcValue> field_values_;
  std::vector<int32_t> element_, jump_, set_, kind_;  // of each path and spec, which have the same numbers
  std::vector<Section> sections_;
};

}  // namespace strandcast
