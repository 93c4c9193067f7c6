#include "tests/support/fake_server.h"

#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <condition_variable>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

namespace strandcast::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using tcp = asio::ip::tcp;
using boost::system::error_code;

}  // namespace

struct FakeServerShared {
  std::mutex mutex;
  std::condition_variable ended;
  bool is_over = false;
};

struct FakePeer::State {
  State(tcp::socket socket, FakeServerShared& server)
      : ws(std::move(socket)), shared(server), waker(dup(ws.next_layer().native_handle())) {}
  ~State() { forget_waker(); }
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  void forget_waker() {
    if (waker >= 0) ::close(std::exchange(waker, -1));
  }

  websocket::stream<tcp::socket> ws;
  FakeServerShared& shared;
  // The socket under a name of its own, by which another thread ends the script's reads; under shared.mutex.
  int waker;
  beast::flat_buffer buffer;
};

bool FakePeer::upgrade(const std::string& protocol) {
  error_code failure;
  http::request<http::string_body> request;
  http::read(state_.ws.next_layer(), state_.buffer, request, failure);
  if (failure || request[http::field::sec_websocket_protocol].empty()) return false;
  state_.ws.set_option(websocket::stream_base::decorator([protocol](websocket::response_type& response) {
    if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
  }));
  state_.ws.binary(true);
  state_.ws.accept(request, failure);
  return !failure;
}

void FakePeer::answer_http(unsigned status, const std::string& body) {
  error_code failure;
  http::request<http::string_body> request;
  http::read(state_.ws.next_layer(), state_.buffer, request, failure);
  http::response<http::string_body> response(static_cast<http::status>(status), 11);
  response.body() = body;
  response.prepare_payload();
  http::write(state_.ws.next_layer(), response, failure);
}

std::optional<Hello> FakePeer::welcome(const Welcome& welcome) {
  if (!upgrade()) return std::nullopt;
  auto hello = read_until<Hello>();
  if (!hello || !send(welcome)) return std::nullopt;
  return hello;
}

bool FakePeer::send(const ServerMessage& message) {
  return send_bytes(encode(message));
}
bool FakePeer::send(const EncodedFrame& frame) {
  return send_bytes(frame.message);
}

bool FakePeer::send_bytes(std::span<const std::byte> bytes) {
  error_code failure;
  state_.ws.binary(true);
  state_.ws.write(asio::buffer(bytes.data(), bytes.size()), failure);
  return !failure;
}

bool FakePeer::send_text(const std::string& text) {
  error_code failure;
  state_.ws.text(true);
  state_.ws.write(asio::buffer(text), failure);
  return !failure;
}

bool FakePeer::send_raw(const std::string& bytes) {
  error_code failure;
  asio::write(state_.ws.next_layer(), asio::buffer(bytes), failure);
  return !failure;
}

std::optional<ClientMessage> FakePeer::read() {
  error_code failure;
  beast::flat_buffer buffer;
  state_.ws.read(buffer, failure);
  if (failure) return std::nullopt;
  const auto data = buffer.cdata();
  auto message = decode_client_message({static_cast<const std::byte*>(data.data()), data.size()});
  if (!message) return std::nullopt;
  return std::move(message).value();
}

void FakePeer::close(uint16_t code, const std::string& reason) {
  error_code failure;
  websocket::close_reason close(code);
  close.reason.assign(reason.data(), reason.size());
  state_.ws.close(close, failure);
}

void FakePeer::reset() {
  {
    const std::lock_guard lock(state_.shared.mutex);
    state_.forget_waker();  // a socket is reset when its last name is closed
  }
  error_code ignored;
  state_.ws.next_layer().set_option(asio::socket_base::linger(true, 0), ignored);
  state_.ws.next_layer().close(ignored);
}

uint16_t FakePeer::read_to_end() {
  error_code failure;
  while (!failure) {
    beast::flat_buffer buffer;
    state_.ws.read(buffer, failure);
  }
  return failure == websocket::error::closed ? state_.ws.reason().code : 0;
}

void FakePeer::wait_for_test_end() {
  std::unique_lock lock(state_.shared.mutex);
  state_.shared.ended.wait(lock, [this] { return state_.shared.is_over; });
}

struct FakeServer::State {
  explicit State(Script run)
      : script(std::move(run)), acceptor(io, tcp::endpoint(asio::ip::address_v4::loopback(), 0)) {
    port = acceptor.local_endpoint().port();
    accepting = std::thread([this] { accept(); });
  }

  ~State() {
    {
      const std::lock_guard lock(shared.mutex);
      shared.is_over = true;
      // shutdown wakes the blocking calls of other threads; close alone would not.
      for (auto& peer : peers)
        if (peer.waker >= 0) ::shutdown(peer.waker, SHUT_RDWR);
    }
    shared.ended.notify_all();
    error_code ignored;
    tcp::socket knock(io);  // wakes accept()
    knock.connect(tcp::endpoint(asio::ip::address_v4::loopback(), port), ignored);
    accepting.join();
    for (auto& thread : threads) thread.join();
  }

  void accept() {
    while (true) {
      error_code failure;
      tcp::socket socket(io);
      acceptor.accept(socket, failure);
      const std::lock_guard lock(shared.mutex);
      if (shared.is_over || failure) return;
      FakePeer::State& state = peers.emplace_back(std::move(socket), shared);
      threads.emplace_back([this, &state] {
        FakePeer peer(state);
        script(peer);
        const std::lock_guard end_lock(shared.mutex);
        error_code ignored;
        state.ws.next_layer().shutdown(tcp::socket::shutdown_both, ignored);
      });
    }
  }

  Script script;
  asio::io_context io;
  tcp::acceptor acceptor;
  uint16_t port = 0;
  FakeServerShared shared;
  std::list<FakePeer::State> peers;
  std::list<std::thread> threads;
  std::thread accepting;
};

FakeServer::FakeServer(Script script) : state_(std::make_unique<State>(std::move(script))) {}
FakeServer::~FakeServer() = default;
uint16_t FakeServer::port() const {
  return state_->port;
}

Welcome make_welcome(uint32_t strand_count, uint32_t vertex_count) {
  Welcome welcome;
  welcome.session_id = "0123456789abcdef";
  welcome.server_version = "fake";
  welcome.scene_name = "fake";
  welcome.codec = "delta";
  welcome.strand_count = strand_count;
  welcome.vertex_count = vertex_count;
  welcome.bound_m = 1e-4f;
  welcome.frame_width = 64;
  welcome.frame_height = 36;
  return welcome;
}

}  // namespace strandcast::test
