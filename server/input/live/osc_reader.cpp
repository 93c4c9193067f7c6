#include "server/input/live/osc_reader.h"

#include <cstring>

#include "common/base/text.h"
#include "server/input/live/big_endian_reader.h"
#include "server/input/live/parsers_private.h"

namespace strandcast {
namespace {

constexpr size_t kOscAlignBytes = 4;
constexpr char kBundleMark[] = "#bundle";  // with its NUL eight bytes
constexpr size_t kTimeTagBytes = 8;
constexpr size_t kMaxShownTextBytes = 40;

size_t padded(size_t bytes) {
  return (bytes + kOscAlignBytes - 1) / kOscAlignBytes * kOscAlignBytes;
}

std::string_view osc_text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A string with its NUL, filled up to four bytes; no NUL within `bytes`: nothing.
std::optional<std::string_view> take_text(std::span<const std::byte>& bytes) {
  const size_t length = osc_text_of(bytes).find('\0');
  if (length == std::string_view::npos || padded(length + 1) > bytes.size()) return std::nullopt;
  const std::string_view text = osc_text_of(bytes).substr(0, length);
  bytes = bytes.subspan(padded(length + 1));
  return text;
}

enum class Skip { Done, TooShort, UnknownTag };

/// Steps over the argument that a tag stands for.
Skip skip_argument(char tag, std::span<const std::byte>& bytes) {
  const auto skip = [&](size_t count) {
    if (count > bytes.size()) return Skip::TooShort;
    bytes = bytes.subspan(count);
    return Skip::Done;
  };
  switch (tag) {
    case 'i':
    case 'f':
    case 'c':
    case 'r':
    case 'm':
      return skip(4);
    case 'h':
    case 'd':
    case 't':
      return skip(8);
    case 'T':
    case 'F':
    case 'N':
    case 'I':
    case '[':
    case ']':
      return Skip::Done;
    case 's':
    case 'S':
      return take_text(bytes) ? Skip::Done : Skip::TooShort;
    case 'b': {
      BigEndianReader reader(bytes);
      const auto size = reader.take<uint32_t>();
      // Before it is rounded up: a size near the largest number would come round to nothing.
      if (!reader.ok() || size > reader.rest().size()) return Skip::TooShort;
      return skip(sizeof(uint32_t) + padded(size));
    }
    default:
      return Skip::UnknownTag;
  }
}

class OscUnfolder {
 public:
  OscUnfolder(std::span<const std::byte> datagram, OscPacket& packet)
      : datagram_(datagram), packet_(packet) {}

  Status read_element(std::span<const std::byte> element, size_t depth) {
    if (element.size() % kOscAlignBytes != 0)
      return make_error(ErrorCode::BadInput, "OSC at byte {}: {} bytes are no multiple of {}",
                        at_byte(element), element.size(), kOscAlignBytes);
    if (element.empty())
      return make_error(ErrorCode::BadInput, "OSC at byte {}: an empty element", at_byte(element));
    if (element.front() == std::byte{'#'}) return read_bundle(element, depth);
    return read_message(element);
  }

 private:
  size_t at_byte(std::span<const std::byte> rest) const {
    return datagram_.size() - (static_cast<size_t>(datagram_.data() + datagram_.size() - rest.data()));
  }

  Status read_bundle(std::span<const std::byte> bundle, size_t depth) {
    const size_t place = at_byte(bundle);
    if (bundle.size() < sizeof(kBundleMark) ||
        std::memcmp(bundle.data(), kBundleMark, sizeof(kBundleMark)) != 0)
      return make_error(ErrorCode::BadInput,
                        "OSC at byte {}: begins with '#' and is not \"#bundle\" with its NUL", place);
    if (depth == kMaxOscBundleDepth)
      return make_error(ErrorCode::LimitExceeded, "OSC at byte {}: more than {} bundles within each other",
                        place, kMaxOscBundleDepth);
    BigEndianReader reader(bundle.subspan(sizeof(kBundleMark)));
    (void)reader.take_bytes(kTimeTagBytes);
    if (!reader.ok())
      return make_error(ErrorCode::BadInput, "OSC at byte {}: a bundle without its time", place);
    for (size_t count = 0; !reader.rest().empty(); ++count) {
      if (count == kMaxOscBundleElements)
        return make_error(ErrorCode::LimitExceeded, "OSC at byte {}: a bundle of more than {} elements",
                          place, kMaxOscBundleElements);
      const size_t element_place = at_byte(reader.rest());
      const auto size = reader.take<uint32_t>();
      if (!reader.ok() || size > reader.rest().size())
        return make_error(ErrorCode::BadInput, "OSC at byte {}: an element of {} bytes where {} are left",
                          element_place, size, reader.rest().size());
      RETURN_IF_ERROR(read_element(reader.take_bytes(size), depth + 1));
    }
    return {};
  }

  Status read_message(std::span<const std::byte> bytes) {
    const size_t place = at_byte(bytes);
    OscMessage message;
    const auto address = take_text(bytes);
    if (!address || !address->starts_with('/'))
      return make_error(ErrorCode::BadInput,
                        "OSC at byte {}: no address that begins with '/' and ends with NUL", place);
    message.address = *address;
    if (!bytes.empty()) {
      const auto tags = take_text(bytes);
      if (!tags || !tags->starts_with(','))
        return make_error(ErrorCode::BadInput, "OSC at byte {}: {} without a list of its arguments' kinds",
                          place, excerpt(message.address, kMaxShownTextBytes));
      message.tags = tags->substr(1);
    }
    message.arguments = bytes;
    for (const char tag : message.tags) {
      const Skip skip = skip_argument(tag, bytes);
      if (skip == Skip::UnknownTag) {
        ++packet_.unknown_tags;
        return {};
      }
      if (skip == Skip::TooShort)
        return make_error(ErrorCode::BadInput, "OSC at byte {}: {} ends within its arguments", place,
                          excerpt(message.address, kMaxShownTextBytes));
    }
    if (!bytes.empty())
      return make_error(ErrorCode::BadInput, "OSC at byte {}: {} has {} bytes behind its last argument",
                        place, excerpt(message.address, kMaxShownTextBytes), bytes.size());
    packet_.messages.push_back(message);
    return {};
  }

  std::span<const std::byte> datagram_;
  OscPacket& packet_;
};

}  // namespace

Result<OscPacket> read_osc(std::span<const std::byte> datagram, uint32_t limit_bytes) {
  if (datagram.size() > limit_bytes)
    return make_error(ErrorCode::LimitExceeded, "OSC of {} bytes; the limit is {}", datagram.size(),
                      limit_bytes);
  OscPacket packet;
  packet.is_bundle = !datagram.empty() && datagram.front() == std::byte{'#'};
  RETURN_IF_ERROR(OscUnfolder(datagram, packet).read_element(datagram, 0));
  return packet;
}

bool OscArguments::next_is(char tag) {
  ok_ = ok_ && tags_.starts_with(tag);
  if (ok_) tags_.remove_prefix(1);
  return ok_;
}

template <class T>
std::optional<T> OscArguments::take_number(char tag) {
  if (!next_is(tag)) return std::nullopt;
  BigEndianReader reader(bytes_);
  const auto value = reader.take<T>();
  bytes_ = reader.rest();
  return value;
}
std::optional<int32_t> OscArguments::take_int() {
  return take_number<int32_t>('i');
}
std::optional<float> OscArguments::take_float() {
  return take_number<float>('f');
}

std::optional<std::string_view> OscArguments::take_string() {
  if (!next_is('s')) return std::nullopt;
  return take_text(bytes_);
}

std::string to_line(const OscMessage& message) {
  std::string line = one_line(message.address, 2 * kMaxShownTextBytes);
  std::span<const std::byte> bytes = message.arguments;
  for (const char tag : message.tags) {
    BigEndianReader reader(bytes);
    if (tag == 'f')
      line += fmt::format(" {:.5g}", reader.take<float>());
    else if (tag == 'd')
      line += fmt::format(" {:.5g}", reader.take<double>());
    else if (tag == 'i')
      line += fmt::format(" {}", reader.take<int32_t>());
    else if (std::span<const std::byte> rest = bytes; tag == 's')
      line += fmt::format(" \"{}\"", excerpt(take_text(rest).value_or(""), kMaxShownTextBytes));
    else
      line += fmt::format(" ({})", tag);
    if (skip_argument(tag, bytes) != Skip::Done) break;
  }
  return line;
}

std::vector<std::string> describe_osc(std::span<const std::byte> packet, size_t limit_bytes) {
  MonitorLines lines;
  const auto osc = read_osc(packet, limit_bytes);
  if (packet.empty() || !osc) return {};
  for (const OscMessage& message : osc->messages) lines.add(lines.has_room() ? to_line(message) : "");
  return std::move(lines).take();
}

}  // namespace strandcast
