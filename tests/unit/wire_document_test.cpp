// proto/WIRE.md is a promise to people who write other clients: its numbers must be those of the code.
#include <regex>
#include <set>

#include "common/base/file.h"
#include "common/pictures/h264_header.h"
#include "common/pictures/jpeg_tiles.h"
#include "common/pictures/picture.h"
#include "common/replay/clock_offset.h"
#include "common/scene/scene_fields.h"
#include "common/strands/scene_asset.h"
#include "common/strands/strand_payload.h"
#include "common/strands/strand_predictor.h"
#include "common/strands/tangent/symbols.h"
#include "common/wire/close_code.h"
#include "common/wire/messages.h"
#include "server/net/strand_class.h"

namespace strandcast::wire_document_test {
namespace {

using namespace tangent;

using testing::HasSubstr;

std::string document() {
  auto text = load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "proto/WIRE.md", 1 << 20);
  EXPECT_TRUE(text) << text.error().to_string();
  return text ? *text : std::string();
}

std::string with_commas(uint64_t value) {
  std::string digits = std::to_string(value);
  for (auto i = static_cast<std::ptrdiff_t>(digits.size()) - 3; i > 0; i -= 3)
    digits.insert(static_cast<size_t>(i), 1, ',');
  return digits;
}

TEST(WireDocument, NamesEveryLimitWithItsValue) {
  const std::vector<std::pair<std::string, std::string>> limits = {
      {"kDefaultPort", std::to_string(kDefaultPort)},
      {"kWebSocketProtocol", kWebSocketProtocol},
      {"kMaxControlBytes", with_commas(kMaxControlBytes)},
      {"kClockWindow", with_commas(kClockWindow)},
      {"kStreamsPerCodec", fmt::format("from {} (", kStreamsPerCodec)},
      {"kMaxRateDivisor", fmt::format("every {}th step", kMaxRateDivisor)},
      {"kFrameHeaderBytes", with_commas(kFrameHeaderBytes)},
      {"kMaxMediaPayloadBytes", with_commas(kMaxMediaPayloadBytes)},
      {"kMaxStrandCount", with_commas(kMaxStrandCount)},
      {"kMaxVertexCount", fmt::format("{}..{}", kMinVertexCount, kMaxVertexCount)},
      {"kMaxTrianglesPerStrand", fmt::format("{} S", kMaxTrianglesPerStrand)},
      {"kMaxMeshVertices", with_commas(kMaxMeshVertices)},
      {"kMaxMeshTriangles", with_commas(kMaxMeshTriangles)},
      {"kMaxGroomExtentM", fmt::format("+-{} m", kMaxGroomExtentM)},
      {"kMaxLattice", with_commas(kMaxLattice)},
      {"kBoundReachM", fmt::format("{} m", kBoundReachM)},
      {"kStrandFixedBytes", with_commas(kStrandFixedBytes)},
      {"kMaxStrandTimeNs", with_commas(kMaxStrandTimeNs)},
      {"kMaxHeadPositionM", with_commas(static_cast<uint64_t>(kMaxHeadPositionM))},
      {"kRotationTolerance", fmt::format("{}", kRotationTolerance)},
      {"kMinPictureSide", fmt::format("{} x {}", kMinPictureSide, kMinPictureSide)},
      {"kMaxPictureWidth",
       fmt::format("{} x {}", with_commas(kMaxPictureWidth), with_commas(kMaxPictureHeight))},
      {"kMaxH264Units", with_commas(kMaxH264Units)},
      {"kMaxVideoReferences", with_commas(kMaxVideoReferences)},
      {"kTileSide", fmt::format("{} x {}", kTileSide, kTileSide)},
      {"kTilesFixedBytes", with_commas(kTilesFixedBytes)},
      {"kTileHeaderBytes", with_commas(kTileHeaderBytes)},
      {"kPictureStreamBit", fmt::format("0x{:04x}", kPictureStreamBit)},
      {"kStepsPerBound", with_commas(kStepsPerBound)},
      {"kMotionClassCount", fmt::format("`kMotionClassCount` {}", kMotionClassCount)},
      {"kFewMotionClasses", fmt::format("`kFewMotionClasses` {}", kFewMotionClasses)},
      {"kManyVertices", with_commas(kManyVertices)},
      {"kHeadStepCount", fmt::format("`kHeadStepCount` {}", kHeadStepCount)},
      {"kMaxLengthBlend", fmt::format("0..{}", kMaxLengthBlend)},
      {"kDriftShare", fmt::format("{} x the drift", kDriftShare)},
      {"kBlockSize", with_commas(kBlockSize)},
      {"kEscapedLength", with_commas(kEscapedLength)},
      {"kShapeClassCount", fmt::format("`kShapeClassCount` {}", kShapeClassCount)},
      {"kShapeFeatureCount", fmt::format("`kShapeFeatureCount` {}", kShapeFeatureCount)},
      {"kTableCount", with_commas(kTableCount)},
      {"kLearnShift", fmt::format(">> {} (", kLearnShift)},
      {"kLeastShare", fmt::format("`kLeastShare` {}", kLeastShare)},
      {"kRansLow", with_commas(kRansLow)},
  };
  const std::string text = document();
  for (const auto& [name, value] : limits) {
    bool is_named = false;
    for (size_t begin = 0; begin < text.size();) {
      const size_t end = std::min(text.find('\n', begin), text.size());
      const std::string line = text.substr(begin, end - begin);
      is_named |= line.find("`" + name + "`") != std::string::npos && line.find(value) != std::string::npos;
      begin = end + 1;
    }
    EXPECT_TRUE(is_named) << "no line of WIRE.md names " << name << " with " << value;
  }
  EXPECT_THAT(text, HasSubstr(fmt::format("{} x {} weights of i16", kRowClassCount, kFeatureCount)));
  EXPECT_THAT(text, HasSubstr(fmt::format("classes x {} weights, in units of 1/{}", kMotionFeatureCount,
                                          with_commas(static_cast<uint64_t>(1.0f / kMotionWeight)))));
  EXPECT_THAT(text,
              HasSubstr(fmt::format("{} x {} weights of i16 for", kShapeClassCount, kShapeFeatureCount)));
  EXPECT_THAT(text, HasSubstr(fmt::format("symbols 0 to {} themselves", kFirstTail - 1)));
  EXPECT_THAT(text, HasSubstr(fmt::format("({} + sum of weight x feature) >> {}", 1 << (kWeightShift - 1),
                                          kWeightShift)));
}

// Ranges that session.proto only names; those that it declares are made into constants.
TEST(WireDocument, GivesTheRangesThatMessagesName) {
  namespace fields = scene_fields;
  const std::vector<std::pair<std::string, fields::Range>> ranges = {
      {"kStrandCount", fields::kStrandCount}, {"kVertexCount", fields::kVertexCount},
      {"kStreamBound", fields::kStreamBound}, {"kStepRate", fields::kStepRate},
      {"kSubsteps", fields::kSubsteps},       {"kFrameRate", fields::kFrameRate},
      {"kJpegQuality", fields::kJpegQuality}};
  const auto text_of = [](double value) {
    if (value >= 1000.0) return with_commas(static_cast<uint64_t>(value));
    return std::regex_replace(fmt::format("{:.6f}", value), std::regex("\\.?0+$"), "");
  };
  const std::string text = document();
  for (const auto& [name, range] : ranges)
    EXPECT_THAT(text, HasSubstr(fmt::format("`{}` {}..{}{}", name, text_of(range.minimum),
                                            text_of(range.maximum), *range.unit ? " " : "") +
                                range.unit))
        << name;
  EXPECT_EQ(fields::kFrameWidth.maximum, kMaxPictureWidth) << "section 7 gives it";
  EXPECT_EQ(fields::kFrameHeight.maximum, kMaxPictureHeight) << "section 7 gives it";
  EXPECT_THAT(text, HasSubstr(fmt::format("`kMaxHeads` {}, `kMaxLiveInputs` {}, `kMaxPictureMotions` {}, "
                                          "`kMaxMotionJoints` {}, `kMaxJointNameBytes` {}",
                                          kMaxHeads, kMaxLiveInputs, kMaxPictureMotions, kMaxMotionJoints,
                                          kMaxJointNameBytes)));
}

TEST(WireDocument, ListsEveryOpcode) {
  const std::string text = document();
  for (const Opcode opcode : {Opcode::Control, Opcode::Asset, Opcode::StrandKeyframe, Opcode::StrandDelta,
                              Opcode::JpegFrame, Opcode::JpegTiles, Opcode::Vp8Frame, Opcode::H264Frame})
    EXPECT_THAT(text, HasSubstr(fmt::format("| `0x{:02x}` |", static_cast<int>(opcode))));
}

/// Without a default: the compiler asks for every new code.
bool is_sent(CloseCode code) {
  switch (code) {
    case CloseCode::Normal:
    case CloseCode::GoingAway:
    case CloseCode::BadData:
    case CloseCode::Policy:
    case CloseCode::TooBig:
    case CloseCode::Internal:
    case CloseCode::TryLater:
    case CloseCode::Unauthorized:
    case CloseCode::Kicked:
    case CloseCode::Full:
    case CloseCode::Refused:
    case CloseCode::NotFound:
      return true;
  }
  return false;
}

TEST(WireDocument, ListsTheCloseCodesThatThereAreAndNoOthers) {
  const std::set<int> by_others = {1002, 1006};  // of the WebSocket libraries on both sides
  const std::string text = document();
  const size_t begin = text.find("## 9. Close codes");
  const std::string section = text.substr(begin, text.find("## 10.", begin) - begin);
  for (int code = 1000; code < 5000; ++code) {
    const bool is_listed = section.find(fmt::format("\n| {} |", code)) != std::string::npos;
    EXPECT_EQ(is_listed, is_sent(static_cast<CloseCode>(code)) || by_others.contains(code)) << code;
  }
}

TEST(WireDocument, ExampleHeaderHasItsBytes) {
  FrameHeader header;
  header.opcode = Opcode::StrandDelta;
  header.stream_id = 0x0201;
  header.sequence = 0x06050403;
  header.base_sequence = 0x0a090807;
  header.payload_bytes = 3;
  header.sim_time_ns = 0x1716151413121110;
  header.send_time_ns = -2;
  std::string bytes;
  for (const std::byte byte : pack(header)) bytes += fmt::format("{:02x} ", static_cast<int>(byte));
  bytes.pop_back();
  EXPECT_THAT(document(), HasSubstr("`" + bytes + "`"));
}

}  // namespace
}  // namespace strandcast::wire_document_test
