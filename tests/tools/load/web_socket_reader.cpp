#include "tests/tools/load/web_socket_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/strands/frame_header.h"
#include "common/wire/messages.h"

namespace strandcast::load {
namespace {

// RFC 6455, section 5.2.
constexpr uint8_t kFinal = 0x80, kMasked = 0x80, kOpcodeBits = 0x0f, kLengthBits = 0x7f;
constexpr uint8_t kTwoByteLength = 126, kEightByteLength = 127;

bool is_control_frame(uint8_t opcode) {
  return opcode >= static_cast<uint8_t>(WebSocketOpcode::Close);
}

}  // namespace

std::vector<std::byte> make_upgrade(const std::string& host, uint16_t port, const std::string& folder) {
  const std::string request = fmt::format(
      "GET {}/v1 HTTP/1.1\r\nHost: {}:{}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
      "Sec-WebSocket-Key: c3RyYW5kY2FzdC1sb2FkIQ==\r\nSec-WebSocket-Version: 13\r\n"
      "Sec-WebSocket-Protocol: {}\r\n\r\n",
      folder, host, port, kWebSocketProtocol);
  const auto bytes = std::as_bytes(std::span(request));
  return {bytes.begin(), bytes.end()};
}

void append_frame(std::vector<std::byte>& out, WebSocketOpcode opcode, std::span<const std::byte> payload) {
  const auto put = [&](uint64_t value) { out.push_back(static_cast<std::byte>(value)); };
  put(kFinal | static_cast<uint8_t>(opcode));
  if (payload.size() < kTwoByteLength) {
    put(kMasked | payload.size());
  } else {
    put(kMasked | kTwoByteLength);
    put(payload.size() >> 8);
    put(payload.size());
  }
  for (int i = 0; i < 4; ++i) put(0);
  out.insert(out.end(), payload.begin(), payload.end());
}

std::optional<WebSocketReader::Event> WebSocketReader::take(std::span<const std::byte>& bytes) {
  if (!is_upgraded_) return take_answer(bytes);
  while (!bytes.empty()) {
    if (frame_left_ == 0) {
      head_.push_back(bytes[0]);
      bytes = bytes.subspan(1);
      if (head_.size() < 2 || head_.size() < 2 + length_bytes()) continue;
      begin_frame();
    } else {
      take_payload(bytes);
    }
    if (frame_left_ > 0) continue;
    if (auto event = end_frame()) return event;
  }
  return std::nullopt;
}

std::optional<WebSocketReader::Event> WebSocketReader::take_answer(std::span<const std::byte>& bytes) {
  constexpr std::string_view kEnd = "\r\n\r\n";
  constexpr size_t kMaxAnswerBytes = 8u << 10;
  head_.insert(head_.end(), bytes.begin(), bytes.end());
  const std::string_view text(reinterpret_cast<const char*>(head_.data()), head_.size());
  const size_t found = text.find(kEnd);
  if (found == std::string_view::npos) {
    bytes = {};
    return text.size() > kMaxAnswerBytes ? std::optional(Event{What::Refused, {}, 0}) : std::nullopt;
  }
  is_upgraded_ = text.starts_with("HTTP/1.1 101");
  bytes = bytes.last(text.size() - found - kEnd.size());  // WebSocket already
  head_.clear();
  return Event{is_upgraded_ ? What::Upgraded : What::Refused, {}, 0};
}

void WebSocketReader::take_payload(std::span<const std::byte>& bytes) {
  const auto piece = bytes.first(std::min<uint64_t>(bytes.size(), frame_left_));
  const bool is_control = is_control_frame(opcode_);
  std::vector<std::byte>& kept = is_control ? control_ : message_;
  const bool is_media =
      !is_control && static_cast<Opcode>(kept.empty() ? piece[0] : kept[0]) != Opcode::Control;
  const size_t wanted = is_media ? kFrameHeaderBytes : kMaxControlBytes;
  const size_t take = std::min(piece.size(), wanted - std::min(wanted, kept.size()));
  kept.insert(kept.end(), piece.begin(), piece.begin() + static_cast<ptrdiff_t>(take));
  if (!is_control) message_bytes_ += piece.size();
  frame_left_ -= piece.size();
  bytes = bytes.subspan(piece.size());
}

size_t WebSocketReader::length_bytes() const {
  const auto length = std::to_integer<uint8_t>(head_[1]) & kLengthBits;
  return length == kTwoByteLength ? 2 : length == kEightByteLength ? 8 : 0;
}

void WebSocketReader::begin_frame() {
  const auto first = std::to_integer<uint8_t>(head_[0]);
  opcode_ = first & kOpcodeBits;
  is_final_ = (first & kFinal) != 0;
  frame_left_ = length_bytes() > 0 ? 0 : std::to_integer<uint64_t>(head_[1]) & kLengthBits;
  for (size_t i = 2; i < head_.size(); ++i)
    frame_left_ = frame_left_ << 8 | std::to_integer<uint64_t>(head_[i]);
  head_.clear();
}

std::optional<WebSocketReader::Event> WebSocketReader::end_frame() {
  if (is_control_frame(opcode_)) {
    auto payload = std::exchange(control_, {});
    if (opcode_ == static_cast<uint8_t>(WebSocketOpcode::Ping))
      return Event{What::Ping, std::move(payload), 0};
    if (opcode_ == static_cast<uint8_t>(WebSocketOpcode::Close))
      return Event{What::Close, std::move(payload), 0};
    return std::nullopt;
  }
  if (!is_final_) return std::nullopt;
  return Event{What::Message, std::exchange(message_, {}), std::exchange(message_bytes_, 0)};
}

}  // namespace strandcast::load
