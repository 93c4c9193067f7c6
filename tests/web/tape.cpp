#include "tests/web/tape.h"

#include "common/strands/byte_io.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

void Tape::add_record(char kind, std::span<const std::byte> bytes) {
  ByteWriter writer(bytes_);
  writer.put(static_cast<uint8_t>(kind));
  writer.put(static_cast<uint32_t>(bytes.size()));
  writer.put_bytes(bytes);
}

void Tape::add_name(const std::string& name) {
  add_record('N', std::as_bytes(std::span(name)));
}

void Tape::add_decoder(const std::string& codec, const StrandStreamLimits& limits,
                       std::span<const glm::vec3> rest_in_head_m) {
  std::vector<std::byte> record;
  ByteWriter writer(record);
  writer.put(limits.strand_count);
  writer.put(limits.vertex_count);
  writer.put_bytes(std::as_bytes(std::span(codec)));
  add_record('D', record);
  if (rest_in_head_m.empty()) return;
  SceneAsset asset;
  asset.strand_count = limits.strand_count;
  asset.vertex_count = limits.vertex_count;
  asset.rest_position_m.assign(rest_in_head_m.begin(), rest_in_head_m.end());
  add_asset(encode_scene_asset(asset), {});
}

void Tape::add_asset(std::span<const std::byte> payload, const Status& status) {
  add_record('A', payload);
  if (!status) return add_error(status.error());
  ByteWriter writer(bytes_);
  writer.put(uint8_t{1});
  writer.put(uint64_t{0});
  writer.put(0.0);
}

void Tape::add_message(std::span<const std::byte> message, const Decoded& decoded, double milliseconds) {
  add_record('M', message);
  if (!decoded) return add_error(decoded.error());
  ByteWriter writer(bytes_);
  writer.put(uint8_t{1});
  writer.put(state_hash(**decoded));
  writer.put(milliseconds);
}

void Tape::add_error(const Error& error) {
  const std::string text = error.to_string();
  ByteWriter writer(bytes_);
  writer.put(uint8_t{0});
  writer.put(static_cast<uint32_t>(text.size()));
  writer.put_bytes(std::as_bytes(std::span(text)));
}

}  // namespace strandcast
