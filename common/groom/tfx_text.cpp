// Version 2 of `.tfx`: header lines, then per strand "strand I numVerts K texcoord U V" and K lines "x y z".
#include <algorithm>
#include <cmath>
#include <string>

#include "common/base/mercy.h"
#include "common/groom/text_scan.h"
#include "common/groom/tfx_loader.h"

namespace strandcast {
namespace {

Result<uint32_t> read_count(TextScan& scan, const char* what) {
  const std::string_view word = scan.next_word();
  const auto value = parse_number<uint32_t>(word);
  if (!value)
    return line_error(scan, ErrorCode::BadInput, "{} is {}, a whole number is needed", what, quoted(word));
  return *value;
}

Result<float> read_coordinate(TextScan& scan, const char* what) {
  const std::string_view word = scan.next_word();
  const auto value = parse_number<float>(word);
  if (!value)
    return line_error(scan, ErrorCode::BadInput, "{} is {}, a number is needed", what, quoted(word));
  return *value;
}

Status expect_word(TextScan& scan, std::string_view expected) {
  const std::string_view word = scan.next_word();
  if (word == expected) return {};
  return line_error(scan, ErrorCode::BadInput, "{} found where '{}' is needed", quoted(word), expected);
}

Status expect_line_end(TextScan& scan) {
  const std::string_view word = scan.next_word();
  if (word.empty()) return {};
  return line_error(scan, ErrorCode::BadInput, "{} found where the line should end", quoted(word));
}

struct TextHeader {
  uint32_t strand_count = 0;
  bool has_both_ends = false;
};

/// Checks the version line, with which the file begins.
Status read_version(TextScan& scan) {
  if (!scan.next_filled_line()) return line_error(scan, ErrorCode::BadInput, "the file is empty");
  RETURN_IF_ERROR(expect_word(scan, "version"));
  const std::string_view word = scan.next_word();
  const auto version = parse_number<float>(word);
  if (!version || *version < 2.0f || *version >= 3.0f) {
    return line_error(scan, ErrorCode::BadInput, "version {}, known as text is 2.0", quoted(word));
  }
  return {};
}

/// Reads up to and including the line "is sorted", or up to "numStrands" where that line is missing; the scan
/// then stands on the first strand line.
Result<TextHeader> read_text_header(TextScan& scan) {
  RETURN_IF_ERROR(read_version(scan));
  TextHeader header;
  bool has_count = false;
  while (scan.next_filled_line()) {
    const std::string_view key = scan.next_word();
    if (key == "strand") {
      if (!has_count)
        return line_error(scan, ErrorCode::BadInput, "the first strand comes before 'numStrands'");
      return header;
    }
    if (key == "numStrands") {
      ASSIGN_OR_RETURN(header.strand_count, read_count(scan, "numStrands"));
      has_count = true;
      if (header.strand_count == 0) return line_error(scan, ErrorCode::BadInput, "0 strands");
      if (header.strand_count > kMaxStrandCount) {
        return line_error(scan, ErrorCode::LimitExceeded,
                          "{} strands, at most {} are allowed: export fewer of them", header.strand_count,
                          kMaxStrandCount);
      }
    } else if (key == "bothEndsImmovable") {
      ASSIGN_OR_RETURN(const uint32_t flag, read_count(scan, "bothEndsImmovable"));
      if (flag > 1)
        return line_error(scan, ErrorCode::BadInput, "bothEndsImmovable is {}, allowed are 0 and 1", flag);
      header.has_both_ends = flag == 1;
    } else if (key != "scale" && key != "rotation" && key != "translation" &&
               key != "maxNumVerticesInStrand" && key != "numFollowHairsPerGuideHair" &&
               key != "maxRadiusAroundGuideHair" && key != "is") {
      return line_error(
          scan, ErrorCode::BadInput,
          "{} is no header field, known are version, scale, rotation, translation, bothEndsImmovable, "
          "maxNumVerticesInStrand, numFollowHairsPerGuideHair, maxRadiusAroundGuideHair, numStrands and "
          "is sorted",
          quoted(key));
    }
  }
  return line_error(scan, ErrorCode::BadInput, "the file ends before the first strand");
}

/// Lines of strands. Each begins with a word that says whether it is the first of a strand.
class StrandLines {
 public:
  /// The scan stands behind the word "strand".
  explicit StrandLines(TextScan& scan) : scan_(scan) {}

  bool at_end() const { return !has_line_; }
  bool at_strand() const { return has_line_ && word_ == "strand"; }
  void next() {
    has_line_ = scan_.next_filled_line();
    word_ = has_line_ ? scan_.next_word() : std::string_view();
  }

  /// Reads the strand at whose first line this stands, to the first line that is none of its own.
  Status read(Groom& groom) {
    word_ = {};
    ASSIGN_OR_RETURN(const uint32_t index, read_count(scan_, "strand number"));
    RETURN_IF_ERROR(expect_word(scan_, "numVerts"));
    ASSIGN_OR_RETURN(const uint32_t count, read_count(scan_, "numVerts"));
    if (count > kMaxSourceVertexCount)
      return line_error(scan_, ErrorCode::BadInput, "numVerts is {}, at most {} are allowed", count,
                        kMaxSourceVertexCount);
    RETURN_IF_ERROR(expect_word(scan_, "texcoord"));
    glm::vec2 uv;
    ASSIGN_OR_RETURN(uv.x, read_coordinate(scan_, "texcoord"));
    ASSIGN_OR_RETURN(uv.y, read_coordinate(scan_, "texcoord"));
    RETURN_IF_ERROR(expect_line_end(scan_));
    for (uint32_t vertex = 0; vertex < count; ++vertex) {
      next();
      if (at_end() || at_strand())
        return line_error(scan_, ErrorCode::BadInput, "strand {} ends at vertex {} of {}", index, vertex,
                          count);
      ASSIGN_OR_RETURN(const glm::vec3 point, read_point());
      groom.rest_position_m.push_back(point);
    }
    next();
    if (!at_end() && !at_strand())
      return line_error(scan_, ErrorCode::BadInput, "{} follows the last of {} vertices of strand {}",
                        quoted(word_), count, index);
    groom.root_uv.push_back(uv);
    groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
    return {};
  }

 private:
  Result<glm::vec3> read_point() {
    glm::vec3 point;
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) word_ = scan_.next_word();
      const auto value = parse_number<float>(word_);
      if (!value)
        return line_error(scan_, ErrorCode::BadInput, "coordinate is {}, a number is needed", quoted(word_));
      point[axis] = *value;
    }
    RETURN_IF_ERROR(expect_line_end(scan_));
    return point;
  }

  TextScan& scan_;
  std::string_view word_ = "strand";
  bool has_line_ = true;
};

/// Reads all strands, also those beyond the announced number, and leaves out those that cannot be used. Notes
/// count both.
Status read_strands(TextScan& scan, uint32_t strand_count, Groom& groom, std::vector<std::string>& notes) {
  BadItems broken;
  StrandLines lines(scan);
  uint32_t seen = 0;
  for (; !lines.at_end(); ++seen) {
    if (seen == kMaxStrandCount)
      return line_error(scan, ErrorCode::LimitExceeded, "more than {} strands", kMaxStrandCount);
    const size_t first = groom.rest_position_m.size();
    if (const Status read = lines.read(groom); !read) {
      broken.add(read.error());
      groom.rest_position_m.resize(first);
      while (!lines.at_end() && !lines.at_strand()) lines.next();
    }
    if (groom.rest_position_m.size() > kMaxGroomVertices)
      return line_error(scan, ErrorCode::LimitExceeded, "more than {} vertices", kMaxGroomVertices);
  }
  for (uint32_t missing = seen; missing < strand_count; ++missing)
    broken.add(
        line_error(scan, ErrorCode::BadInput, "the file ends after {} of {} strands", seen, strand_count));
  if (seen > strand_count)
    notes.push_back(fmt::format("{} strands are announced, {} are there", strand_count, seen));
  return broken.settle(std::max(seen, strand_count), "strands", "and are left out", notes);
}

/// Tells rows of three numbers with decimal commas from rows whose numbers are separated by commas.
bool has_decimal_commas(std::string_view text) {
  constexpr std::string_view kBlank = " \t", kDigits = "0123456789";
  const auto is_digit = [&](char c) { return kDigits.find(c) != std::string_view::npos; };
  for (TextScan scan(text); scan.next_line();) {
    const std::string_view line = scan.rest();
    size_t words = 0, commas = 0;
    for (size_t i = 0; i < line.size(); ++i) {
      const bool follows_blank = i == 0 || kBlank.find(line[i - 1]) != std::string_view::npos;
      if (follows_blank && kBlank.find(line[i]) == std::string_view::npos) ++words;
      const bool is_between = i > 0 && i + 1 < line.size() && is_digit(line[i - 1]) && is_digit(line[i + 1]);
      if (line[i] == ',' && is_between) ++commas;
    }
    if (words == 3 && commas > 0) return true;
  }
  return false;
}

}  // namespace

Result<StatedGroom> read_tfx_text(std::string_view text) {
  std::string with_points;
  if (has_decimal_commas(text)) {
    with_points = text;
    std::replace(with_points.begin(), with_points.end(), ',', '.');
    text = with_points;
  }
  TextScan scan(text);
  ASSIGN_OR_RETURN(const TextHeader header, read_text_header(scan));
  Groom groom;
  groom.offset.push_back(0);
  StatedGroom stated;
  RETURN_IF_ERROR(read_strands(scan, header.strand_count, groom, stated.notes));
  stated.groom = with_pinning(std::move(groom), header.has_both_ends ? Pinning::BothEnds : Pinning::RootPair);
  if (!with_points.empty()) stated.notes.emplace_back("its numbers have decimal commas");
  return stated;
}

}  // namespace strandcast
