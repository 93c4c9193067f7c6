#include "tests/support/raw_client.h"

#include <boost/asio/connect.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>

namespace strandcast::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using beast::error_code;

constexpr auto kDeadline = std::chrono::seconds(30);

}  // namespace

struct RawClient::State {
  asio::io_context io;
  websocket::stream<tcp::socket> socket{io};
  websocket::response_type response;
  uint16_t port = 0;

  /// Starts an operation and runs it to its end; operation_aborted after the deadline.
  template <class Start>
  error_code wait(Start start) {
    error_code result = asio::error::operation_aborted;
    bool is_done = false;
    start([&](const error_code& error, auto&&...) {
      result = error;
      is_done = true;
    });
    io.restart();
    io.run_for(kDeadline);
    if (!is_done) {
      error_code ignored;
      socket.next_layer().close(ignored);
      io.restart();
      io.run();
      result = asio::error::timed_out;
    }
    return result;
  }
};

RawClient::RawClient(uint16_t port, int receive_buffer_bytes) : state_(std::make_unique<State>()) {
  state_->port = port;
  tcp::socket& socket = state_->socket.next_layer();
  error_code ignored;
  socket.open(tcp::v4(), ignored);
  if (receive_buffer_bytes > 0)
    socket.set_option(asio::socket_base::receive_buffer_size(receive_buffer_bytes), ignored);
  socket.connect({asio::ip::address_v4::loopback(), port}, ignored);
  state_->socket.binary(true);
  state_->socket.read_message_max(kMaxMediaPayloadBytes + kFrameHeaderBytes);
}

RawClient::~RawClient() = default;

bool RawClient::handshake(const HandshakeOptions& options) {
  state_->socket.set_option(websocket::stream_base::decorator([&](websocket::request_type& request) {
    if (!options.protocol.empty()) request.set(beast::http::field::sec_websocket_protocol, options.protocol);
    if (!options.origin.empty()) request.set(beast::http::field::origin, options.origin);
    if (!options.forwarded_for.empty()) request.set("X-Forwarded-For", options.forwarded_for);
    if (!options.hello.empty()) request.set("Strandcast-Hello", options.hello);
  }));
  const std::string host = options.host.empty() ? "127.0.0.1:" + std::to_string(state_->port) : options.host;
  const error_code error = state_->wait(
      [&](auto handler) { state_->socket.async_handshake(state_->response, host, options.path, handler); });
  return !error && state_->response[beast::http::field::sec_websocket_protocol] == options.protocol;
}

int RawClient::http_status() const {
  return static_cast<int>(state_->response.result_int());
}

void RawClient::send(const ClientMessage& message) {
  send_bytes(encode(message));
}

void RawClient::send_bytes(std::span<const std::byte> bytes) {
  state_->wait(
      [&](auto handler) { state_->socket.async_write(asio::buffer(bytes.data(), bytes.size()), handler); });
}

void RawClient::send_text(const std::string& text) {
  state_->socket.text(true);
  state_->wait([&](auto handler) { state_->socket.async_write(asio::buffer(text), handler); });
  state_->socket.binary(true);
}

bool RawClient::send_raw(const std::string& bytes) {
  return !state_->wait(
      [&](auto handler) { asio::async_write(state_->socket.next_layer(), asio::buffer(bytes), handler); });
}

bool RawClient::read_raw(size_t byte_count) {
  std::vector<std::byte> bytes(byte_count);
  return !state_->wait(
      [&](auto handler) { asio::async_read(state_->socket.next_layer(), asio::buffer(bytes), handler); });
}

std::string RawClient::read_answer() {
  constexpr std::string_view kLength = "Content-Length: ";
  std::string text;
  tcp::socket& socket = state_->socket.next_layer();
  while (!text.ends_with("\r\n\r\n")) {
    char one = 0;
    if (state_->wait([&](auto handler) { asio::async_read(socket, asio::buffer(&one, 1), handler); }))
      return text;
    text.push_back(one);
  }
  const size_t field = text.find(kLength);
  const size_t header_bytes = text.size();
  if (field == std::string::npos) return text;
  text.resize(header_bytes + std::stoul(text.substr(field + kLength.size())));
  const error_code error = state_->wait([&](auto handler) {
    asio::async_read(socket, asio::buffer(text.data() + header_bytes, text.size() - header_bytes), handler);
  });
  if (error) text.resize(header_bytes);
  return text;
}

std::string RawClient::read_raw_to_end() {
  std::string text;
  state_->wait([&](auto handler) {
    asio::async_read(state_->socket.next_layer(), asio::dynamic_buffer(text), handler);
  });
  return text;
}

Received RawClient::read() {
  beast::flat_buffer buffer;
  const error_code error = state_->wait([&](auto handler) { state_->socket.async_read(buffer, handler); });
  Received received;
  if (error) {
    received.is_end = true;
    if (error == websocket::error::closed) received.close_code = state_->socket.reason().code;
    return received;
  }
  const auto* data = static_cast<const std::byte*>(buffer.cdata().data());
  received.bytes.assign(data, data + buffer.size());
  return received;
}

std::optional<std::vector<std::byte>> RawClient::read_media(Opcode opcode) {
  while (true) {
    Received received = read();
    if (received.is_end) return std::nullopt;
    if (received.opcode() == opcode) return std::move(received.bytes);
  }
}

RawClient::End RawClient::read_end() {
  End end;
  while (true) {
    const Received received = read();
    if (received.is_end) {
      end.close_code = received.close_code;
      return end;
    }
    if (received.opcode() != Opcode::Control) continue;
    const Result<ServerMessage> message = decode_server_message(received.bytes);
    if (!message) continue;
    if (const Goodbye* goodbye = std::get_if<Goodbye>(&*message)) end.reason = goodbye->reason;
  }
}

void RawClient::close() {
  state_->wait([&](auto handler) { state_->socket.async_close(websocket::close_code::normal, handler); });
}

void RawClient::reset() {
  error_code ignored;
  state_->socket.next_layer().set_option(asio::socket_base::linger(true, 0), ignored);
  state_->socket.next_layer().close(ignored);
}

std::string http_get(uint16_t port, const std::string& path, const std::string& host) {
  RawClient client(port);
  client.send_raw("GET " + path + " HTTP/1.1\r\nHost: " + (host.empty() ? "127.0.0.1" : host) + "\r\n\r\n");
  return client.read_raw_to_end();
}

}  // namespace strandcast::test
