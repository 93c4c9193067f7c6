// Tape: what decoders were given, in order, and what came of it, as a file that tests/web/play.mjs plays to
// the strand core in WebAssembly. Little-endian records: a byte for the kind, u32 length, so many bytes;
//   N  name of what follows
//   D  u32 strands, u32 vertices, the codec's name: a new decoder
//   A  an asset's payload for it, M a message for it; behind the bytes a byte: 1, then u64 state hash and f64
//      milliseconds of decoding, or 0, then u32 length and the text of the error
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/base/file.h"
#include "common/strands/strand_codec.h"

namespace strandcast {

class Tape {
 public:
  using Decoded = Result<std::shared_ptr<const Snapshot>>;

  void add_name(const std::string& name);
  /// Without a rest shape nothing is said of it.
  void add_decoder(const std::string& codec, const StrandStreamLimits& limits,
                   std::span<const glm::vec3> rest_in_head_m);
  void add_asset(std::span<const std::byte> payload, const Status& status);
  void add_message(std::span<const std::byte> message, const Decoded& decoded, double milliseconds);
  Status save(const std::filesystem::path& path) const { return save_file(path, bytes_); }

 private:
  void add_record(char kind, std::span<const std::byte> bytes);
  void add_error(const Error& error);

  std::vector<std::byte> bytes_;
};

}  // namespace strandcast
