#include "tests/conformance/stored_stream.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <optional>
#include <sstream>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/strands/frame_header.h"
#include "common/strands/strand_codec.h"
#include "common/strands/zstd_block.h"
#include "tests/conformance/reference_hash.h"

namespace strandcast::conformance {
namespace {

constexpr uint64_t kMaxFileBytes = 1u << 20;
constexpr size_t kLongestRestBytes = 4096;  // of a rest shape that is written out

Bytes point_bytes_of(std::span<const glm::vec3> points) {
  const auto bytes = std::as_bytes(points);
  return {bytes.begin(), bytes.end()};
}

/// Reads a line word by word.
class Words {
 public:
  Words(const std::string& line, std::string place) : stream_(line), place_(std::move(place)) {}

  std::string text() {
    std::string word;
    if (!(stream_ >> word) && !error_) error_ = make_error(ErrorCode::BadInput, "a word is missing");
    return word;
  }
  bool has_more() { return !error_ && !(stream_ >> std::ws).eof(); }
  template <class Number>
  Number number(int base) {
    const std::string word = text();
    Number value{};
    const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value, base);
    if (!error_ && (failure != std::errc() || end != word.data() + word.size()))
      error_ = make_error(ErrorCode::BadInput, "\"{}\" is not a number", word.substr(0, 40));
    return value;
  }
  uint32_t count() { return number<uint32_t>(10); }
  uint64_t hash() { return number<uint64_t>(16); }
  Bytes bytes() {
    auto read = from_hex(text());
    if (!read && !error_) error_ = read.error();
    return read ? *read : Bytes();
  }
  Status status() const { return error_ ? Status(at(place_, *error_)) : Status(); }

 private:
  std::istringstream stream_;
  std::string place_;
  std::optional<Error> error_;
};

void read_rest(Words& words, StoredStream& stored) {
  const std::string word = words.text();
  stored.stream.has_rest = word != "none";
  stored.rest_hash = reference_hash({});
  if (word == "none") return;
  if (word == "made") {
    stored.rest_hash = words.hash();
    stored.rest_in_head_m = rest_shape_of(stored.stream);
    return;
  }
  const auto bytes = from_hex(word);
  if (!bytes || bytes->size() % sizeof(glm::vec3) != 0) return;  // its size will be found wrong
  stored.rest_in_head_m.resize(bytes->size() / sizeof(glm::vec3));
  std::memcpy(stored.rest_in_head_m.data(), bytes->data(), bytes->size());
  stored.rest_hash = reference_hash(stored.rest_in_head_m);
}

Status read_line(const std::string& line, const std::string& place, StoredStream& stored) {
  Words words(line, place);
  const std::string kind = words.text();
  if (kind == "codec") {
    stored.stream.codec = words.text();
    stored.codec_number = words.count();
  } else if (kind == "size") {
    stored.stream.strand_count = words.count();
    stored.stream.vertex_count = words.count();
    stored.stream.coded_count = words.count();
  } else if (kind == "rest") {
    read_rest(words, stored);
  } else if (kind == "step") {
    StoredStep& step = stored.steps.emplace_back();
    step.input_hash = words.hash();
    step.state_hash = words.hash();
    step.frame = words.bytes();
    if (words.has_more()) step.keyframe = words.bytes();
  } else {
    return at(place, make_error(ErrorCode::BadInput, "a line begins with \"{}\"", kind.substr(0, 40)));
  }
  return words.status();
}

/// The zstd frame at `begin`: as long as the number before it says, else to the end. Empty when there is
/// none.
std::span<const std::byte> zstd_frame_at(std::span<const std::byte> bytes, size_t begin) {
  constexpr std::array kMagic = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f}, std::byte{0xfd}};
  const auto rest = bytes.subspan(begin);
  if (rest.size() < kMagic.size() || !std::equal(kMagic.begin(), kMagic.end(), rest.begin())) return {};
  uint32_t length = 0;
  if (begin >= sizeof(length)) std::memcpy(&length, bytes.data() + begin - sizeof(length), sizeof(length));
  return length > kMagic.size() && length <= rest.size() ? rest.first(length) : rest;
}

/// With every zstd frame, and its length where one stands in front of it, replaced by what it holds.
Bytes unpacked(std::span<const std::byte> bytes) {
  constexpr size_t kMostBytes = 1u << 20;
  Bytes plain;
  for (size_t i = 0; i < bytes.size();) {
    const auto frame = zstd_frame_at(bytes, i);
    const auto content_bytes = zstd_content_bytes(frame, kMostBytes);
    if (frame.empty() || !content_bytes) {
      plain.push_back(bytes[i++]);
      continue;
    }
    Bytes content(*content_bytes);
    if (!ZstdDecompressor().fill(frame, content)) {
      plain.push_back(bytes[i++]);
      continue;
    }
    uint32_t before = 0;
    if (i >= sizeof(before)) std::memcpy(&before, bytes.data() + i - sizeof(before), sizeof(before));
    const bool has_length = before == frame.size() && plain.size() >= sizeof(before);
    if (has_length) plain.erase(plain.end() - sizeof(before), plain.end());
    plain.insert(plain.end(), content.begin(), content.end());
    i += frame.size();
  }
  return plain;
}

}  // namespace

StoredStream make_stream(const StreamCase& stream) {
  StoredStream made;
  made.stream = stream;
  made.rest_in_head_m = rest_shape_of(stream);
  made.rest_hash = reference_hash(made.rest_in_head_m);
  const auto encoder = std::move(make_strand_encoder(stream.codec)).value();
  const auto decoder =
      std::move(make_strand_decoder(stream.codec, {stream.strand_count, stream.vertex_count})).value();
  encoder->set_rest_shape(made.rest_in_head_m);
  decoder->set_rest_shape(made.rest_in_head_m);
  for (const StreamStep& step : steps_of(stream)) {
    const JoinFrames frames = step.is_join ? encoder->encode_for_join(step.snapshot)
                                           : JoinFrames{encoder->encode(step.snapshot), nullptr};
    const auto decoded = decoder->decode(frames.frame->message);
    CHECK(decoded.ok());
    made.steps.push_back({reference_state_hash(step.snapshot), reference_state_hash(**decoded),
                          frames.frame->message, frames.keyframe ? frames.keyframe->message : Bytes()});
  }
  made.codec_number = static_cast<uint32_t>(made.steps.front().frame.at(kFrameHeaderBytes));
  return made;
}

std::string file_name_of(const StoredStream& stream) {
  return fmt::format("strands_{}_{}_{}.txt", stream.stream.codec, stream.codec_number, stream.stream.name);
}

std::string to_text(const StoredStream& stored) {
  const StreamCase& stream = stored.stream;
  std::string text = fmt::format("codec {} {}\nsize {} {} {}\n", stream.codec, stored.codec_number,
                                 stream.strand_count, stream.vertex_count, stream.coded_count);
  const Bytes rest = point_bytes_of(stored.rest_in_head_m);
  if (rest.empty())
    text += "rest none\n";
  else if (rest.size() > kLongestRestBytes)
    text += fmt::format("rest made {:016x}\n", stored.rest_hash);
  else
    text += fmt::format("rest {}\n", to_hex(rest));
  for (const StoredStep& step : stored.steps)
    text += fmt::format("step {:016x} {:016x} {}{}{}\n", step.input_hash, step.state_hash, to_hex(step.frame),
                        step.keyframe.empty() ? "" : " ", to_hex(step.keyframe));
  return text;
}

Result<StoredStream> load_stream(const std::filesystem::path& path) {
  ASSIGN_OR_RETURN(const std::string text, load_text(path, kMaxFileBytes));
  StoredStream stored;
  std::istringstream lines(text);
  size_t number = 0;
  for (std::string line; std::getline(lines, line);)
    RETURN_IF_ERROR(read_line(line, fmt::format("{}:{}", path.string(), ++number), stored));
  const std::string begin = fmt::format("strands_{}_{}_", stored.stream.codec, stored.codec_number);
  const std::string stem = path.stem().string();
  if (!stem.starts_with(begin))
    return at(path.string(), make_error(ErrorCode::BadInput, "the name does not begin with {}", begin));
  stored.stream.name = stem.substr(begin.size());
  const size_t points =
      stored.stream.has_rest ? size_t{stored.stream.strand_count} * stored.stream.vertex_count : 0;
  if (stored.steps.empty() || stored.rest_in_head_m.size() != points)
    return at(path.string(), make_error(ErrorCode::BadInput, "it has no steps, or a rest shape of {} points",
                                        stored.rest_in_head_m.size()));
  return stored;
}

std::string to_hex(std::span<const std::byte> bytes) {
  std::string digits;
  for (const std::byte byte : bytes) digits += fmt::format("{:02x}", static_cast<unsigned>(byte));
  return digits;
}

Result<Bytes> from_hex(const std::string& digits) {
  Bytes bytes;
  for (size_t i = 0; i < digits.size(); i += 2) {
    uint8_t byte = 0;
    const auto [end, failure] =
        std::from_chars(digits.data() + i, digits.data() + std::min(i + 2, digits.size()), byte, 16);
    if (failure != std::errc() || end != digits.data() + i + 2)
      return make_error(ErrorCode::BadInput, "no two hexadecimal digits at {}", i);
    bytes.push_back(static_cast<std::byte>(byte));
  }
  return bytes;
}

bool is_same_payload(std::span<const std::byte> a, std::span<const std::byte> b) {
  return std::ranges::equal(a, b) || unpacked(a) == unpacked(b);
}

bool is_same_message(std::span<const std::byte> a, std::span<const std::byte> b) {
  const auto header_a = unpack_frame_header(a);
  auto header_b = unpack_frame_header(b);
  if (!header_a || !header_b) return false;
  header_b->payload_bytes = header_a->payload_bytes;  // of packed parts
  return *header_a == *header_b &&
         is_same_payload(a.subspan(kFrameHeaderBytes), b.subspan(kFrameHeaderBytes));
}

}  // namespace strandcast::conformance
