// NetStream: a TCP connection, with or without TLS, as one type, so that HTTP and WebSocket are compiled for
// one. One thread. No deadlines of its own: closing socket() ends what is under way. For the net folders
// only.
#pragma once

#include <boost/asio/any_completion_handler.hpp>
#include <boost/asio/async_result.hpp>
#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/container/static_vector.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "common/net/tls_context.h"

namespace strandcast::net {

class NetStream {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  using executor_type = Socket::executor_type;
  using error_code = boost::system::error_code;
  using Done = boost::asio::any_completion_handler<void(error_code)>;
  using Transferred = boost::asio::any_completion_handler<void(error_code, size_t)>;

  explicit NetStream(Socket socket);
  NetStream(NetStream&&) noexcept;
  ~NetStream();

  executor_type get_executor();
  Socket& socket();
  bool is_tls() const;
  /// What was written and the other side's kernel has not taken yet; its getting less shows a link at work.
  size_t untaken_bytes();
  /// When bytes of the other side were read last, by now_ns(); 0 before the first. Any thread.
  int64_t received_ns() const;
  /// Closes at once.
  void close();

  /// Completes when a byte can be read; is_tls_hello() then tells what it begins. Takes nothing.
  void async_wait_readable(Done done);
  /// True when the other side has begun with a TLS handshake. After async_wait_readable() only.
  bool is_tls_hello();

  /// Gives back what was read too far: the next reads begin with it. Not while a read is under way.
  void put_back(std::span<const std::byte> bytes);

  /// Limits the bytes of all later reads together; after them reading fails with message_size. A stream
  /// begins with kNoReadLimit, which lifts the limit.
  void limit_reading(uint64_t bytes);
  static constexpr uint64_t kNoReadLimit = ~uint64_t{0};

  /// From here on everything is encrypted.
  void async_accept_tls(const TlsContextPtr& context, Done done);
  /// The certificate must be trusted and be for `host`, a name or a numeric address.
  void async_connect_tls(const TlsContextPtr& context, const std::string& host, Done done);
  /// What is wrong with the other side's certificate, as a person reads it; empty when nothing is.
  std::string certificate_trouble() const;

  /// An error of TLS itself, not of the connection under it.
  static bool is_tls_error(const error_code& error);

  /// Tells the other side that nothing more comes; with TLS, waits for the same from there.
  void async_shut_down(Done done);
  /// After WebSocket's closing handshake. A truncated stream cannot be mistaken for a whole one there.
  void async_tear_down(boost::beast::role_type role, Done done);

  template <class Buffers, class Token>
  auto async_read_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(error_code, size_t)>(
        [this](auto handler, const MutableBuffers& some) {
          read_some(some, Transferred(std::move(handler)));
        },
        token, first_of<MutableBuffers>(buffers));
  }
  template <class Buffers, class Token>
  auto async_write_some(const Buffers& buffers, Token&& token) {
    return boost::asio::async_initiate<Token, void(error_code, size_t)>(
        [this](auto handler, const ConstBuffers& some) { write_some(some, Transferred(std::move(handler))); },
        token, first_of<ConstBuffers>(buffers));
  }

 private:
  static constexpr size_t kMaxBuffers = 8;  // of one call; the rest has its turn in the next
  using MutableBuffers = boost::container::static_vector<boost::asio::mutable_buffer, kMaxBuffers>;
  using ConstBuffers = boost::container::static_vector<boost::asio::const_buffer, kMaxBuffers>;

  template <class Some, class Buffers>
  static Some first_of(const Buffers& buffers) {
    Some some;
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (auto at = boost::asio::buffer_sequence_begin(buffers); at != end && some.size() < kMaxBuffers;
         ++at) {
      const typename Some::value_type buffer = *at;
      if (buffer.size() > 0) some.push_back(buffer);
    }
    return some;
  }
  void read_some(const MutableBuffers& buffers, Transferred done);
  void read_fresh(const MutableBuffers& buffers, Transferred done);
  void write_some(const ConstBuffers& buffers, Transferred done);

  struct State;
  std::unique_ptr<State> state_;
};

// What WebSocket asks of a stream that it does not know.
void beast_close_socket(NetStream& stream);
void teardown(boost::beast::role_type role, NetStream& stream, NetStream::error_code& error);
template <class Handler>
void async_teardown(boost::beast::role_type role, NetStream& stream, Handler&& handler) {
  stream.async_tear_down(role, NetStream::Done(std::forward<Handler>(handler)));
}

}  // namespace strandcast::net
