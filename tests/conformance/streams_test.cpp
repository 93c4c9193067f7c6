// Strand streams of every codec number that ever left this repository decode to the states they were kept
// with, and today's encoders still make the same bytes of the same inputs.
#include <map>

#include "common/base/file.h"
#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "tests/conformance/reference_hash.h"
#include "tests/conformance/stored_stream.h"

namespace strandcast::conformance::streams_test {
namespace {

const std::filesystem::path kFolder =
    std::filesystem::path(STRANDCAST_SOURCE_DIR) / "tests/conformance/vectors";

std::vector<StoredStream> stored_streams() {
  std::vector<StoredStream> streams;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder)) {
    if (!entry.path().filename().string().starts_with("strands_")) continue;
    auto stream = load_stream(entry.path());
    EXPECT_TRUE(stream) << stream.error().to_string();
    if (stream) streams.push_back(*std::move(stream));
  }
  return streams;
}

/// Numbers of releases that decoders still speak beside today's.
const std::map<std::string, std::set<uint32_t>> kSpoken = {{"step", {12, 13, 14, 15}}};

/// The number that a codec writes today, by a stream of one strand.
uint32_t number_of(const std::string& codec) {
  const StoredStream stream = make_stream({"number", codec, 1, 2, 1});
  return stream.codec_number;
}

std::unique_ptr<StrandDecoder> decoder_for(const StoredStream& stored) {
  auto decoder =
      make_strand_decoder(stored.stream.codec, {stored.stream.strand_count, stored.stream.vertex_count});
  EXPECT_TRUE(decoder) << decoder.error().to_string();
  (*decoder)->set_rest_shape(stored.rest_in_head_m);
  return std::move(*decoder);
}

/// The hash of what a message decodes to, by the code and by the document.
void expect_state(StrandDecoder& decoder, const Bytes& message, uint64_t state_hash_then) {
  const auto decoded = decoder.decode(message);
  ASSERT_TRUE(decoded) << decoded.error().to_string();
  EXPECT_EQ(state_hash(**decoded), state_hash_then);
  EXPECT_EQ(reference_state_hash(**decoded), state_hash_then);
}

void expect_states(const StoredStream& stored) {
  std::vector<std::unique_ptr<StrandDecoder>> viewers;  // the first from the start, each join adds one
  viewers.push_back(decoder_for(stored));
  for (const StoredStep& step : stored.steps) {
    for (const auto& viewer : viewers) expect_state(*viewer, step.frame, step.state_hash);
    if (step.keyframe.empty()) continue;
    viewers.push_back(decoder_for(stored));
    expect_state(*viewers.back(), step.keyframe, step.state_hash);
  }
}

TEST(Conformance, KeptStreamsDecodeToTheStatesTheyWereKeptWith) {
  size_t decoded = 0;
  size_t decoded_before = 0;
  for (const StoredStream& stored : stored_streams()) {
    SCOPED_TRACE(file_name_of(stored));
    const bool is_todays = stored.codec_number == number_of(stored.stream.codec);
    const auto spoken = kSpoken.find(stored.stream.codec);
    if (is_todays || (spoken != kSpoken.end() && spoken->second.contains(stored.codec_number))) {
      expect_states(stored);
      ++(is_todays ? decoded : decoded_before);
      continue;
    }
    // A number that is no longer spoken is refused by name, and never taken for another one.
    const auto refused = decoder_for(stored)->decode(stored.steps.front().frame);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, testing::HasSubstr(fmt::format("codec {}", stored.codec_number)));
  }
  EXPECT_EQ(decoded, stream_cases().size());
  EXPECT_EQ(decoded_before, 36u);
}

TEST(Conformance, KeptStreamsHoldEveryKindOfFrame) {
  std::map<std::string, std::set<std::string>> kinds;  // of each codec
  for (const StoredStream& stored : stored_streams()) {
    auto& found = kinds[stored.stream.codec];
    for (size_t i = 0; i < stored.steps.size(); ++i) {
      const auto opcode = static_cast<Opcode>(stored.steps[i].frame.at(0));
      found.insert(opcode == Opcode::StrandDelta ? "delta"
                   : i == 0                      ? "first keyframe"
                                                 : "keyframe of a new chain");
      if (!stored.steps[i].keyframe.empty()) found.insert("join");
    }
    if (stored.stream.coded_count < stored.stream.strand_count) found.insert("prefix");
  }
  const std::set<std::string> kAll = {"first keyframe", "delta", "keyframe of a new chain", "join", "prefix"};
  for (const StrandCodecInfo& codec : strand_codecs()) {
    if (codec.name == "raw") continue;  // has keyframes only
    EXPECT_EQ(kinds[codec.name], kAll) << codec.name;
  }
  EXPECT_EQ(kinds.size(), strand_codecs().size())
      << "a codec has no kept stream: add cases and run conformance_write";
}

bool has_the_same_inputs(const StoredStream& then, const StoredStream& now) {
  bool is_same = now.steps.size() == then.steps.size() && now.rest_hash == then.rest_hash;
  for (size_t i = 0; is_same && i < now.steps.size(); ++i)
    is_same = now.steps[i].input_hash == then.steps[i].input_hash;
  return is_same;
}

bool makes_the_same_bytes(const StoredStream& then, const StoredStream& now) {
  for (size_t i = 0; i < now.steps.size(); ++i) {
    const bool has_keyframe = !then.steps[i].keyframe.empty();
    if (has_keyframe == now.steps[i].keyframe.empty()) return false;
    if (!is_same_message(then.steps[i].frame, now.steps[i].frame)) return false;
    if (has_keyframe && !is_same_message(then.steps[i].keyframe, now.steps[i].keyframe)) return false;
  }
  return true;
}

TEST(Conformance, EncodersMakeTheKeptBytes) {
  std::map<std::string, StoredStream> kept;
  for (StoredStream& stored : stored_streams()) kept[file_name_of(stored)] = std::move(stored);
  for (const StreamCase& stream : stream_cases()) {
    const StoredStream now = make_stream(stream);
    const std::string name = file_name_of(now);
    SCOPED_TRACE(name);
    ASSERT_TRUE(kept.contains(name))
        << "Codec '" << stream.codec << "' writes number " << now.codec_number
        << ", of which no stream is kept. Run conformance_write "
           "tests/conformance/vectors and commit the new files beside the old ones.";
    const StoredStream& then = kept[name];
    ASSERT_TRUE(has_the_same_inputs(then, now)) << "The inputs are no longer made as they were: leave "
                                                   "conformance_inputs.cpp alone, and add cases of other "
                                                   "names.";
    EXPECT_TRUE(makes_the_same_bytes(then, now))
        << "Codec '" << stream.codec << "' makes other bytes than those that are kept for number "
        << now.codec_number
        << ". Viewers that know this number are out there: give the codec the next number (its constant, "
           "section 6 of "
           "proto/WIRE.md), run conformance_write tests/conformance/vectors, and commit the new files beside "
           "the old "
           "ones. The old files stay as they are.";
  }
}

TEST(WireDocument, NamesEveryCodecWithItsNumber) {
  const auto text = load_text(std::filesystem::path(STRANDCAST_SOURCE_DIR) / "proto/WIRE.md", 1 << 20);
  ASSERT_TRUE(text) << text.error().to_string();
  const size_t begin = text->find("| 0 | u8 | codec: ");
  const std::string row =
      begin == std::string::npos ? "" : text->substr(begin, text->find('\n', begin) - begin);
  for (const StrandCodecInfo& codec : strand_codecs()) {
    const std::string entry = fmt::format(" {} {}", number_of(codec.name), codec.name);
    EXPECT_TRUE(row.find(entry) != std::string::npos) << "the fixed part in WIRE.md has not:" << entry;
  }
}

// What the comparison lets pass: other packing by zstd, and nothing else.
TEST(Conformance, OtherBytesInOneFrameAreNoticed) {
  const StoredStream stream = make_stream({"any", "delta", 3, 4, 3});
  StoredStream changed = stream;
  EXPECT_TRUE(makes_the_same_bytes(stream, changed));
  Bytes& frame = changed.steps.back().frame;
  for (const size_t place : {size_t{8}, kFrameHeaderBytes, frame.size() - 1}) {
    const std::byte before = frame[place];
    frame[place] ^= std::byte{1};
    EXPECT_FALSE(makes_the_same_bytes(stream, changed)) << place;
    frame[place] = before;
  }
}

}  // namespace
}  // namespace strandcast::conformance::streams_test
