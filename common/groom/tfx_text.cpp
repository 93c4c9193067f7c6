// Version 2 of `.tfx`: header lines, then per strand "strand I numVerts K texcoord U V" and K lines "x y z".
#include <cmath>

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
        return line_error(scan, ErrorCode::LimitExceeded, "{} strands, at most {} are allowed",
                          header.strand_count, kMaxStrandCount);
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

/// Reads one strand; the scan stands behind the word "strand" of its first line.
Status read_strand(TextScan& scan, uint32_t strand, Groom& groom) {
  ASSIGN_OR_RETURN(const uint32_t index, read_count(scan, "strand number"));
  if (index != strand) {
    return line_error(scan, ErrorCode::BadInput, "strand {} found where strand {} is needed", index, strand);
  }
  RETURN_IF_ERROR(expect_word(scan, "numVerts"));
  ASSIGN_OR_RETURN(const uint32_t count, read_count(scan, "numVerts"));
  if (count < kMinVertexCount || count > kMaxSourceVertexCount) {
    return line_error(scan, ErrorCode::BadInput, "numVerts is {}, allowed are {} to {}", count,
                      kMinVertexCount, kMaxSourceVertexCount);
  }
  if (groom.rest_position_m.size() + count > kMaxGroomVertices) {
    return line_error(scan, ErrorCode::LimitExceeded, "more than {} vertices", kMaxGroomVertices);
  }
  RETURN_IF_ERROR(expect_word(scan, "texcoord"));
  glm::vec2 uv;
  ASSIGN_OR_RETURN(uv.x, read_coordinate(scan, "texcoord"));
  ASSIGN_OR_RETURN(uv.y, read_coordinate(scan, "texcoord"));
  RETURN_IF_ERROR(expect_line_end(scan));
  groom.root_uv.push_back(uv);
  for (uint32_t vertex = 0; vertex < count; ++vertex) {
    if (!scan.next_filled_line()) {
      return line_error(scan, ErrorCode::BadInput, "the file ends at vertex {} of {} of strand {}", vertex,
                        count, strand);
    }
    glm::vec3 point;
    for (int axis = 0; axis < 3; ++axis) {
      ASSIGN_OR_RETURN(point[axis], read_coordinate(scan, "coordinate"));
    }
    RETURN_IF_ERROR(expect_line_end(scan));
    groom.rest_position_m.push_back(point);
  }
  groom.offset.push_back(static_cast<uint32_t>(groom.rest_position_m.size()));
  return {};
}

}  // namespace

Result<Groom> read_tfx_text(std::string_view text) {
  TextScan scan(text);
  ASSIGN_OR_RETURN(const TextHeader header, read_text_header(scan));
  Groom groom;
  groom.offset.push_back(0);
  for (uint32_t strand = 0; strand < header.strand_count; ++strand) {
    if (strand > 0) {
      if (!scan.next_filled_line()) {
        return line_error(scan, ErrorCode::BadInput, "the file ends after {} of {} strands", strand,
                          header.strand_count);
      }
      RETURN_IF_ERROR(expect_word(scan, "strand"));
    }
    RETURN_IF_ERROR(read_strand(scan, strand, groom));
  }
  if (scan.next_filled_line()) {
    return line_error(scan, ErrorCode::BadInput, "{} follows the last of {} strands",
                      quoted(scan.next_word()), header.strand_count);
  }
  return with_pinning(std::move(groom), header.has_both_ends ? Pinning::BothEnds : Pinning::RootPair);
}

}  // namespace strandcast
