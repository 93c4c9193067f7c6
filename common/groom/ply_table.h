// PlyTable: reads the rows of a `.ply` file, element by element, text or binary of either byte order. Knows
// nothing of strands. Untrusted input. Private to the loader; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/result.h"

namespace strandcast {

enum class PlyFormat { Text, LittleEndian, BigEndian };
enum class PlyType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float32, Float64 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::Float32;
  std::optional<PlyType> count_type;  // set: a list, of so many values
};

struct PlyElement {
  std::string name;
  uint64_t row_count = 0;
  std::vector<PlyProperty> property;

  /// Returns the index of the property with one of these names that is (or is not) a list, as `is_list` says.
  /// Empty if there is none.
  std::optional<size_t> find(std::initializer_list<std::string_view> names, bool is_list) const;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::Text;
  std::vector<PlyElement> element;
  std::vector<std::string> comment;
  size_t body_at = 0;  // offset of the first row
};

/// Reads and checks the header. BadInput or LimitExceeded name the line.
Result<PlyHeader> read_ply_header(std::string_view file);

inline constexpr size_t kMaxPlyNumberChars = 64;  // of one with a decimal comma

/// Reads the rows of a body in file order.
class PlyRows {
 public:
  PlyRows(std::string_view file, const PlyHeader& header)
      : text_(file), at_(header.body_at), format_(header.format) {}

  /// Reads the next row of `element`: the values of all properties, lists flattened. In text, what is no
  /// number is NaN where a fraction may stand. Errors name element, row and property. Spans are valid until
  /// the next call.
  Status read(const PlyElement& element, uint64_t row);
  double value(size_t property) const { return value_[begin_[property]]; }
  std::span<const double> list(size_t property) const {
    return std::span(value_).subspan(begin_[property], begin_[property + 1] - begin_[property]);
  }
  /// Returns true after a read failed because the file is cut off.
  bool has_ended() const { return has_ended_; }
  /// Returns the number of unread bytes after the last row; white space does not count in text files.
  size_t left_bytes() const;
  /// Returns how many numbers of a text file had a decimal comma.
  uint64_t decimal_commas() const { return decimal_commas_; }

 private:
  Error ended(std::string_view what);
  Result<double> next(PlyType type);
  Result<double> next_word(PlyType type);

  std::string_view text_;
  size_t at_;
  PlyFormat format_;
  uint64_t decimal_commas_ = 0;
  bool has_ended_ = false;
  std::vector<double> value_;
  std::vector<size_t> begin_;  // (properties + 1) where each one's values begin
};

}  // namespace strandcast
