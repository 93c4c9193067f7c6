// RawClient: a WebSocket client for server tests that shares no code with the product's client and may
// misbehave on purpose. Blocking calls with a generous deadline; one thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/strands/frame_header.h"
#include "common/wire/close_code.h"
#include "common/wire/messages.h"

namespace strandcast::test {

/// What arrived: a message, or the end of the connection.
struct Received {
  std::vector<std::byte> bytes;
  bool is_end = false;
  uint16_t close_code = 0;  // 0 when the connection broke without a closing handshake

  Opcode opcode() const { return static_cast<Opcode>(bytes.empty() ? 0 : static_cast<uint8_t>(bytes[0])); }
};

struct HandshakeOptions {
  std::string path = "/v1";
  std::string host;    // empty: the real one
  std::string origin;  // empty: none
  std::string protocol = kWebSocketProtocol;
  std::string forwarded_for = {};  // X-Forwarded-For; empty: none
  std::string hello = {};          // Strandcast-Hello; empty: none
};

class RawClient {
 public:
  /// Connects TCP to loopback; a receive buffer of 0 leaves the system's.
  explicit RawClient(uint16_t port, int receive_buffer_bytes = 0);
  ~RawClient();

  /// True when the server upgraded; otherwise http_status() tells.
  bool handshake(const HandshakeOptions& options = {});
  int http_status() const;

  void send(const ClientMessage& message);
  void send_bytes(std::span<const std::byte> bytes);
  void send_text(const std::string& text);
  /// Bytes below WebSocket; false when the connection has ended.
  bool send_raw(const std::string& bytes);
  /// So many bytes below WebSocket; false when the connection ends before.
  bool read_raw(size_t byte_count);
  /// One answer to a GET, by its Content-Length: header and body; less when the connection ends before.
  std::string read_answer();
  /// Everything until the server closes, below WebSocket.
  std::string read_raw_to_end();

  Received read();
  /// Reads until a control message of type T; nullopt at the end of the connection.
  template <class T>
  std::optional<T> read_control() {
    while (true) {
      const Received received = read();
      if (received.is_end) return std::nullopt;
      if (received.opcode() != Opcode::Control) continue;
      const Result<ServerMessage> message = decode_server_message(received.bytes);
      if (!message) return std::nullopt;
      if (const T* wanted = std::get_if<T>(&*message)) return *wanted;
    }
  }
  /// Reads until a media message of this kind; nullopt at the end of the connection.
  std::optional<std::vector<std::byte>> read_media(Opcode opcode);
  /// Reads to the end of the connection: the close code, and the Goodbye if there was one.
  struct End {
    uint16_t close_code = 0;
    std::string reason;
  };
  End read_end();

  void close();
  /// Ends the connection with a TCP reset.
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// GET `path` with this Host; the whole answer as text.
std::string http_get(uint16_t port, const std::string& path, const std::string& host = {});

}  // namespace strandcast::test
