// libFuzzer entry: one datagram as OSC, and several as what a VMC performer sends.
#include "server/input/live/osc_reader.h"
#include "tests/fuzz/fuzz_input.h"
#include "tests/fuzz/live_checks.h"

namespace strandcast::live_osc_fuzz {
namespace {

/// Messages lie within the datagram, and their arguments as their tags say.
void check_osc(std::span<const std::byte> datagram) {
  const auto osc = read_osc(datagram, kMaxDatagramBytes);
  if (!osc) return;
  const auto is_inside = [&](const void* begin, size_t size) {
    const auto* first = static_cast<const std::byte*>(begin);
    return size == 0 || (first >= datagram.data() && first + size <= datagram.data() + datagram.size());
  };
  for (const OscMessage& message : osc->messages) {
    CHECK(message.address.starts_with('/') && is_inside(message.address.data(), message.address.size()));
    CHECK(is_inside(message.tags.data(), message.tags.size()));
    CHECK(is_inside(message.arguments.data(), message.arguments.size()));
    OscArguments arguments(message);
    size_t taken_bytes = 0;
    for (const char tag : message.tags) {
      const bool is_taken = tag == 'i'   ? arguments.take_int().has_value()
                            : tag == 'f' ? arguments.take_float().has_value()
                            : tag == 's' ? arguments.take_string().has_value()
                                         : false;
      if (!is_taken) break;
      taken_bytes += sizeof(int32_t);  // at least
    }
    CHECK(taken_bytes <= message.arguments.size());
    const std::string line = to_line(message);
    CHECK(one_line(line, line.size()) == line);
  }
}

}  // namespace

extern "C" int FUZZ_ENTRY(live_osc)(const uint8_t* data, size_t size) {
  FuzzInput input(data, size);
  LiveParserConfig config;
  config.protocol = "vmc";
  config.ignores_zero_positions = (input.take<uint8_t>() & 1) != 0;
  config.max_datagram_bytes = kMaxDatagramBytes;
  LiveParserPair parsers(config);
  while (!input.is_empty()) {
    const auto datagram = input.take_piece();
    check_osc(datagram);
    parsers.parse(datagram);
  }
  return 0;
}

}  // namespace strandcast::live_osc_fuzz
