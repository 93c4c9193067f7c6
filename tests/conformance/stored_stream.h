// A kept strand stream as a text file: one item a line, bytes as hexadecimal digits. Lines:
//   codec NAME NUMBER
//   size STRANDS VERTICES CODED       strands of the asset, vertices of each, strands that the stream has
//   rest none | rest made HASH | rest BYTES        as in the asset; "made": large, as conformance_inputs says
//   step INPUT STATE FRAME [KEYFRAME] hash of what was coded, hash of what it decodes to, the message for
//   those
//                                     who follow, and that for who joins
// Hashes are those of proto/WIRE.md, that of a rest shape over its bytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "tests/conformance/conformance_inputs.h"

namespace strandcast::conformance {

using Bytes = std::vector<std::byte>;

struct StoredStep {
  uint64_t input_hash = 0;
  uint64_t state_hash = 0;
  Bytes frame;
  Bytes keyframe;  // empty where nobody joins
};

struct StoredStream {
  StreamCase stream;
  uint32_t codec_number = 0;
  uint64_t rest_hash = 0;
  std::vector<glm::vec3> rest_in_head_m;
  std::vector<StoredStep> steps;
};

/// What today's encoder makes of a case.
StoredStream make_stream(const StreamCase& stream);

/// "strands_CODEC_NUMBER_NAME.txt"
std::string file_name_of(const StoredStream& stream);
std::string to_text(const StoredStream& stream);
/// The inverse; the name of the case is the last part of the file's.
Result<StoredStream> load_stream(const std::filesystem::path& path);

std::string to_hex(std::span<const std::byte> bytes);
Result<Bytes> from_hex(const std::string& digits);

/// Whether two payloads are the same, or would be if zstd packed alike: another release of it packs
/// otherwise.
bool is_same_payload(std::span<const std::byte> a, std::span<const std::byte> b);
/// Likewise of media messages.
bool is_same_message(std::span<const std::byte> a, std::span<const std::byte> b);

}  // namespace strandcast::conformance
