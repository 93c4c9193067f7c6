// FakeServer: a server for client tests that misbehaves on purpose. It shares no code with the product's
// server: each connection is handed to a script that reads and writes with blocking calls on a thread of its
// own.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/strands/frame_header.h"
#include "common/wire/messages.h"

namespace strandcast::test {

/// The client's end of one connection. Calls after the client has gone do nothing and report the end.
class FakePeer {
 public:
  /// Answers the WebSocket upgrade with this subprotocol; false when the client asked for none or has gone.
  bool upgrade(const std::string& protocol = kWebSocketProtocol);
  /// Reads the HTTP request and answers with this status instead of upgrading.
  void answer_http(unsigned status, const std::string& body);
  /// upgrade(), the client's Hello, then this Welcome; the Hello, or nothing when the client has gone.
  std::optional<Hello> welcome(const Welcome& welcome);

  bool send(const ServerMessage& message);
  bool send(const EncodedFrame& frame);
  bool send_bytes(std::span<const std::byte> bytes);
  bool send_text(const std::string& text);
  /// Bytes below WebSocket.
  bool send_raw(const std::string& bytes);
  /// The client's next message; nothing at the end of the connection or for what it should not have sent.
  std::optional<ClientMessage> read();
  /// Reads until a message of type T.
  template <class T>
  std::optional<T> read_until() {
    while (auto message = read())
      if (const T* wanted = std::get_if<T>(&*message)) return *wanted;
    return std::nullopt;
  }
  /// Closing handshake with this code.
  void close(uint16_t code, const std::string& reason);
  /// Ends the connection with a TCP reset.
  void reset();
  /// Reads until the client ends the connection; its close code, 0 when it broke off.
  uint16_t read_to_end();
  /// Blocks, reading nothing, until the test is over.
  void wait_for_test_end();

  struct State;
  explicit FakePeer(State& state) : state_(state) {}

 private:
  State& state_;
};

class FakeServer {
 public:
  using Script = std::function<void(FakePeer&)>;
  /// Listens on a free loopback port; every connection runs the script.
  explicit FakeServer(Script script);
  ~FakeServer();
  uint16_t port() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// A Welcome for a stream of these sizes with the "delta" codec.
Welcome make_welcome(uint32_t strand_count, uint32_t vertex_count);

}  // namespace strandcast::test
