// Reads OSC 1.0 from one datagram. Bundles are flattened, and every message is checked to its last byte
// before any is returned. An own strict reader, because existing OSC libraries trust sizes from outside. Any
// thread.
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

constexpr size_t kMaxOscBundleDepth = 4;       // bundles within bundles
constexpr size_t kMaxOscBundleElements = 256;  // of one bundle
/// Largest payload of a UDP datagram.
constexpr uint32_t kMaxDatagramBytes = 65'507;

/// A message as views into its datagram.
struct OscMessage {
  std::string_view address;              // from its '/'
  std::string_view tags;                 // of the arguments, without the comma
  std::span<const std::byte> arguments;  // of known kinds whole; of others up to the message's end
};

struct OscPacket {
  std::vector<OscMessage> messages;  // in their order, those of inner bundles at their place
  bool is_bundle = false;            // else the datagram is one message
  uint64_t unknown_tags = 0;         // messages left out, as nobody knows how long their arguments are
};

/// Reads a datagram of at most `limit_bytes`; an error names the byte.
Result<OscPacket> read_osc(std::span<const std::byte> datagram, uint32_t limit_bytes);

/// Reads a message's arguments in order. After a wrong type or the end, it returns nothing more. Remaining
/// arguments are ignored.
class OscArguments {
 public:
  explicit OscArguments(const OscMessage& message) : tags_(message.tags), bytes_(message.arguments) {}

  std::optional<int32_t> take_int();
  std::optional<float> take_float();
  std::optional<std::string_view> take_string();
  /// Returns true while all requested arguments were present.
  bool ok() const { return ok_; }

 private:
  bool next_is(char tag);
  template <class T>
  std::optional<T> take_number(char tag);

  std::string_view tags_;
  std::span<const std::byte> bytes_;
  bool ok_ = true;
};

/// Formats a message for a person: "/address  1 2.5 "text"".
std::string to_line(const OscMessage& message);

}  // namespace strandcast
