// The client's side of WebSocket (RFC 6455) as bytes: writes frames, and takes apart what a server sends,
// from its answer to the upgrade on. Of media it keeps the header only. No I/O; a connection's own thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace strandcast::load {

/// Frame opcodes of RFC 6455, section 5.2.
enum class WebSocketOpcode : uint8_t { Binary = 0x2, Close = 0x8, Ping = 0x9, Pong = 0xa };

/// The request to switch to WebSocket.
std::vector<std::byte> make_upgrade(const std::string& host, uint16_t port, const std::string& folder = {});

/// A client's frame; the mask is zero, which the standard allows and which changes nothing.
void append_frame(std::vector<std::byte>& out, WebSocketOpcode opcode, std::span<const std::byte> payload);

class WebSocketReader {
 public:
  enum class What { Upgraded, Refused, Message, Ping, Close };
  struct Event {
    What what = What::Message;
    std::vector<std::byte> payload;  // of a control message or frame all, of media the header
    uint64_t message_bytes = 0;      // all of them
  };
  /// Removes bytes from the front up to the end of the next event; all of them when there is none.
  std::optional<Event> take(std::span<const std::byte>& bytes);

 private:
  std::optional<Event> take_answer(std::span<const std::byte>& bytes);
  void take_payload(std::span<const std::byte>& bytes);
  size_t length_bytes() const;
  void begin_frame();
  std::optional<Event> end_frame();

  bool is_upgraded_ = false;
  std::vector<std::byte> head_;  // of the HTTP answer, then of the frame under way
  uint8_t opcode_ = 0;
  bool is_final_ = false;
  uint64_t frame_left_ = 0;         // payload bytes
  std::vector<std::byte> control_;  // payload of a control frame, which may stand between those of a message
  std::vector<std::byte> message_;  // what is kept of the message under way
  uint64_t message_bytes_ = 0;
};

}  // namespace strandcast::load
