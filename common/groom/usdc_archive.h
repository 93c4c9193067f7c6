// UsdcArchive: tokens, paths, specs and values of USD's binary form ("crate"). Untrusted input: counts are
// checked before anything is allocated, and values are read where they are asked for. Private to the loader;
// one thread.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/groom/groom_source.h"
#include "common/groom/usdc_coding.h"

namespace strandcast {

inline constexpr size_t kMaxUsdcItems = 4'000'000;  // tokens, strings, fields, field sets, paths or specs
inline constexpr size_t kMaxUsdcTokenBytes = 64u << 20;
inline constexpr size_t kMaxUsdcFields = 64;  // of one spec

struct UsdcPath {
  uint32_t parent = 0;
  int32_t token = 0;  // its last element
};

struct UsdcSpec {
  uint32_t path = 0;
  uint32_t fields = 0;  // index of its first one
  UsdcKind kind = UsdcKind::Attribute;
};

class UsdcArchive {
 public:
  UsdcArchive(UsdcArchive&&) = default;
  UsdcArchive& operator=(UsdcArchive&&) = default;
  UsdcArchive(const UsdcArchive&) = delete;  // tokens are views

  /// Reads everything but values. BadInput, LimitExceeded or Unsupported.
  static Result<UsdcArchive> read(std::shared_ptr<GroomSource> source);

  const std::vector<UsdcPath>& paths() const { return paths_; }
  const std::vector<UsdcSpec>& specs() const { return specs_; }
  const UsdcSpec& root() const { return specs_[root_]; }
  std::string_view token(int32_t index) const { return tokens_[static_cast<size_t>(index)]; }
  /// Returns a spec's value of a name; empty if it has none. BadInput for indices that lead nowhere.
  Result<std::optional<UsdcValue>> field(const UsdcSpec& spec, std::string_view name) const;

  /// Reads a value that is one token or string.
  Result<std::string_view> text(UsdcValue value) const;
  /// Reads a list of tokens, as their indices.
  Result<std::vector<int32_t>> texts(UsdcValue value, size_t limit) const;
  /// Reads the numbers of a scalar, vector, quaternion (its real part first) or matrix (row by row).
  Result<std::vector<double>> numbers(UsdcValue value) const;
  /// Reads arrays. A blocked value is an empty one.
  Result<std::vector<glm::vec3>> points(UsdcValue value, size_t limit) const;
  Result<std::vector<float>> floats(UsdcValue value, size_t limit) const;
  Result<std::vector<int32_t>> ints(UsdcValue value, size_t limit) const;
  /// Reads an array of numbers or of pairs of them, one behind the other; empty for other values.
  Result<std::vector<double>> list(UsdcValue value, size_t limit) const;

  struct Sample {
    double time = 0.0;
    UsdcValue value;
  };
  /// Reads one of time samples, in their order; empty if there are not that many.
  Result<std::optional<Sample>> sample(UsdcValue value, uint64_t index) const;

 private:
  struct Span {
    uint64_t offset = 0;
    uint64_t count = 0;  // items, or bytes of a section
  };
  struct Section {
    std::string name;
    Span bytes;
  };
  class Cursor;

  explicit UsdcArchive(std::shared_ptr<GroomSource> source) : source_(std::move(source)) {}
  Status read_header();
  Result<Cursor> section(std::string_view name) const;
  Status read_tokens();
  Status read_fields();
  Status read_paths();
  Status place_paths(const std::array<std::vector<int32_t>, 3>& coded);
  Status read_specs();
  Status check_token(int64_t index) const;
  Result<Span> array_span(UsdcValue value, size_t limit) const;
  Result<std::vector<float>> packed_floats(const Span& span, UsdcType type) const;
  Result<std::vector<float>> stored_floats(const Span& span, UsdcType type) const;

  std::shared_ptr<GroomSource> source_;
  uint8_t minor_version_ = 0;
  std::vector<Section> sections_;
  std::vector<std::byte> token_text_;
  std::vector<std::string_view> tokens_;
  std::vector<uint32_t> strings_;  // tokens
  std::vector<int32_t> field_names_;
  std::vector<UsdcValue> field_values_;
  std::vector<int32_t> field_sets_;  // fields of one spec after another, each with -1 behind
  std::vector<UsdcPath> paths_;
  std::vector<UsdcSpec> specs_;
  uint32_t root_ = 0;
};

}  // namespace strandcast
