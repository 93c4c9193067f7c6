#include "server/net/live_receiver.h"

#include <array>
#include <atomic>
#include <boost/asio/buffer.hpp>
#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/multicast.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "common/base/check.h"
#include "common/base/profile.h"
#include "common/base/text.h"
#include "common/base/thread_name.h"
#include "common/log/log.h"

namespace strandcast {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;
using std::chrono::milliseconds;

constexpr size_t kMaxDatagramBytes = 65'536;
constexpr int kReceiveBufferBytes = 1 << 20;  // of the kernel: a second of the fastest source
constexpr size_t kMaxShownHostChars = 100;

IpAddress to_address(const asio::ip::address& address) {
  return address.is_v4() ? IpAddress(address.to_v4().to_bytes()) : IpAddress(address.to_v6().to_bytes());
}

std::string to_text(const asio::ip::address& address, uint16_t port) {
  const IpAddress plain = to_address(address);
  return plain.is_v4() ? fmt::format("{}:{}", plain.to_string(), port)
                       : fmt::format("[{}]:{}", plain.to_string(), port);
}

Error bind_error(const LivePort& port, const error_code& error) {
  if (error == asio::error::address_in_use)
    return at(port.field, make_error(ErrorCode::Unavailable,
                                     "port {} for {} is in use by another program: end it, or take another "
                                     "port (--mocap {}:PORT) and send there",
                                     port.port, port.protocol, port.protocol));
  return at(port.field, make_error(ErrorCode::Unavailable, "cannot listen for {} on port {}: {}",
                                   port.protocol, port.port, error.message()));
}

Result<asio::ip::address> find_host(asio::io_context& io, const LivePort& port) {
  error_code error;
  const auto numeric = asio::ip::make_address(port.host, error);
  if (!error) return numeric;
  const auto found = udp::resolver(io).resolve(port.host, "", error);
  if (error || found.empty())
    return at(port.field + ".host", make_error(ErrorCode::NotFound, "no address is known for '{}': {}",
                                               excerpt(port.host, kMaxShownHostChars), error.message()));
  return found.begin()->endpoint().address();
}

/// A port for datagrams.
class DatagramInput : public std::enable_shared_from_this<DatagramInput> {
 public:
  DatagramInput(asio::io_context& io, const LivePort& port, size_t index, LiveHandler& handler)
      : port_(port), index_(index), handler_(handler), socket_(io), request_timer_(io) {}

  Status open(asio::io_context& io, const std::vector<AddressRange>& allowed);
  void start() {
    receive();
    if (port_.request_port != 0) ask(true);
  }
  void close() {
    error_code ignored;
    socket_.close(ignored);
    request_timer_.cancel();
  }

 private:
  bool may_send(const IpAddress& sender) const {
    if (asked_) return sender == to_address(*asked_);
    return sender.is_loopback() || is_in(allowed_, sender);
  }
  void receive();
  void on_receive(size_t size);
  void ask(bool is_first);
  void send(std::vector<std::byte> bytes);

  const LivePort port_;
  const size_t index_;
  LiveHandler& handler_;
  udp::socket socket_;
  asio::steady_timer request_timer_;
  std::vector<AddressRange> allowed_;
  std::optional<asio::ip::address> asked_;  // the one that may send
  std::optional<asio::ip::address> heard_;  // the newest that sent
  udp::endpoint sender_;
  std::array<std::byte, kMaxDatagramBytes> bytes_{};
};

Status DatagramInput::open(asio::io_context& io, const std::vector<AddressRange>& allowed) {
  allowed_ = allowed;
  std::optional<asio::ip::address> group;
  if (!port_.host.empty()) {
    ASSIGN_OR_RETURN(const asio::ip::address host, find_host(io, port_));
    (host.is_multicast() ? group : asked_) = host;
  } else if (!port_.group.empty() && !allowed.empty()) {
    group = asio::ip::make_address(port_.group);
  }
  const bool is_local = !group && (asked_ ? asked_->is_loopback() : allowed.empty());
  bool is_v6 = (group && group->is_v6()) || (asked_ && asked_->is_v6());
  for (const AddressRange& range : allowed) is_v6 = is_v6 || (!group && !asked_ && !range.first.is_v4());
  error_code error;
  socket_.open(is_v6 ? udp::v6() : udp::v4(), error);
  if (!error && is_v6) socket_.set_option(asio::ip::v6_only(false), error);
  // Several programs may hear one group; one port is one program's.
  if (!error && group) socket_.set_option(asio::socket_base::reuse_address(true), error);
  const asio::ip::address any =
      is_v6 ? asio::ip::address(asio::ip::address_v6::any()) : asio::ip::address(asio::ip::address_v4::any());
  const asio::ip::address loopback = is_v6 ? asio::ip::address(asio::ip::address_v6::loopback())
                                           : asio::ip::address(asio::ip::address_v4::loopback());
  if (!error) socket_.bind({is_local ? loopback : any, port_.port}, error);
  if (error) return bind_error(port_, error);
  if (group) socket_.set_option(asio::ip::multicast::join_group(*group), error);
  if (error)
    return at(port_.field, make_error(ErrorCode::Unavailable, "cannot join the group {} of {}: {}",
                                      group->to_string(), port_.protocol, error.message()));
  socket_.set_option(asio::socket_base::receive_buffer_size(kReceiveBufferBytes), error);  // as far as it may
  return {};
}

void DatagramInput::receive() {
  socket_.async_receive_from(asio::buffer(bytes_), sender_,
                             [self = shared_from_this()](const error_code& error, size_t size) {
                               if (error == asio::error::operation_aborted || !self->socket_.is_open())
                                 return;
                               // An ICMP answer to a request is no reason to end.
                               if (!error) self->on_receive(size);
                               self->receive();
                             });
}

void DatagramInput::on_receive(size_t size) {
  const int64_t arrival_ns = now_ns();
  const std::string sender = to_text(sender_.address(), sender_.port());
  if (const IpAddress address = to_address(sender_.address()); !may_send(address))
    return handler_.on_refused(index_, sender,
                               asked_ ? fmt::format("{} alone was asked", to_address(*asked_).to_string())
                                      : fmt::format("--mocap-allow {} lets it", address.to_string()));
  heard_ = sender_.address();
  (void)handler_.on_bytes(index_, sender, std::span(bytes_).first(size), arrival_ns);
}

/// Asks who is asked, or in a group whom was heard.
void DatagramInput::ask(bool is_first) {
  send(is_first && asked_ ? handler_.greeting(index_) : handler_.request(index_));
  request_timer_.expires_after(milliseconds(kLiveRequestMs));
  request_timer_.async_wait([self = shared_from_this()](const error_code& error) {
    if (!error) self->ask(false);
  });
}

void DatagramInput::send(std::vector<std::byte> bytes) {
  const auto& peer = asked_ ? asked_ : heard_;
  if (bytes.empty() || !peer) return;
  auto shared = std::make_shared<std::vector<std::byte>>(std::move(bytes));
  socket_.async_send_to(asio::buffer(*shared), {*peer, port_.request_port},
                        [shared](const error_code&, size_t) {});  // it is asked again
}

/// A server that is asked over TCP, again and again until it answers.
class ConnectionInput : public std::enable_shared_from_this<ConnectionInput> {
 public:
  ConnectionInput(asio::io_context& io, const LivePort& port, size_t index, LiveHandler& handler)
      : port_(port), index_(index), handler_(handler), socket_(io), timer_(io) {}

  Status open(asio::io_context& io) {
    ASSIGN_OR_RETURN(const asio::ip::address host, find_host(io, port_));
    server_ = {host, port_.port};
    return {};
  }
  void start() { connect(); }
  void close() {
    is_closed_ = true;
    error_code ignored;
    socket_.close(ignored);
    timer_.cancel();
  }

 private:
  void connect() {
    socket_.async_connect(server_, [self = shared_from_this()](const error_code& error) {
      if (self->is_closed_) return;
      if (error) return self->retry(fmt::format("cannot be reached: {}", error.message()));
      error_code ignored;
      self->socket_.set_option(tcp::no_delay(true), ignored);
      self->handler_.on_connection(self->index_);
      self->write(self->handler_.greeting(self->index_));
      self->read();
    });
  }
  void write(std::vector<std::byte> bytes) {
    if (bytes.empty()) return;
    auto shared = std::make_shared<std::vector<std::byte>>(std::move(bytes));
    asio::async_write(
        socket_, asio::buffer(*shared),
        [shared, self = shared_from_this()](const error_code&, size_t) {});  // the read ends too
  }
  void read() {
    socket_.async_read_some(
        asio::buffer(bytes_), [self = shared_from_this()](const error_code& error, size_t size) {
          if (self->is_closed_) return;
          if (error) return self->retry(error.message());
          const std::string sender = to_text(self->server_.address(), self->server_.port());
          if (!self->handler_.on_bytes(self->index_, sender, std::span(self->bytes_).first(size), now_ns()))
            return self->retry("what it sends cannot be read");
          self->read();
        });
  }
  void retry(const std::string& why) {
    error_code ignored;
    socket_.close(ignored);
    handler_.on_no_connection(index_, why);
    timer_.expires_after(milliseconds(kLiveRetryMs));
    timer_.async_wait([self = shared_from_this()](const error_code& error) {
      if (!error && !self->is_closed_) self->connect();
    });
  }

  const LivePort port_;
  const size_t index_;
  LiveHandler& handler_;
  tcp::socket socket_;
  asio::steady_timer timer_;
  tcp::endpoint server_;
  bool is_closed_ = false;
  std::array<std::byte, kMaxDatagramBytes> bytes_{};
};

}  // namespace

struct LiveReceiver::State {
  explicit State(LiveHandler& live_handler) : handler(live_handler), tick_timer(io) {}

  void tick() {
    const bool is_active = handler.on_tick(now_ns());
    tick_timer.expires_after(milliseconds(is_active ? kLiveTickMs : kLiveIdleTickMs));
    tick_timer.async_wait([this](const error_code& error) {
      if (!error) tick();
    });
  }
  void run() {
    name_thread("mocap");
    while (!io.stopped()) {
      try {
        io.run();
      } catch (const std::exception& exception) {
        log_error("mocap", "{}", exception.what());
      }
    }
  }

  LiveHandler& handler;
  asio::io_context io{1};
  asio::steady_timer tick_timer;
  std::vector<std::shared_ptr<DatagramInput>> datagrams;
  std::vector<std::shared_ptr<ConnectionInput>> connections;
  std::thread thread;
};

LiveReceiver::LiveReceiver(std::unique_ptr<State> state) : state_(std::move(state)) {}

LiveReceiver::~LiveReceiver() {
  stop();
}

Result<std::unique_ptr<LiveReceiver>> LiveReceiver::open(const std::vector<LivePort>& ports,
                                                         const std::vector<AddressRange>& allowed,
                                                         LiveHandler& handler) {
  auto state = std::make_unique<State>(handler);
  for (size_t i = 0; i < ports.size(); ++i) {
    if (ports[i].is_connection) {
      auto input = std::make_shared<ConnectionInput>(state->io, ports[i], i, handler);
      RETURN_IF_ERROR(input->open(state->io));
      state->connections.push_back(std::move(input));
    } else {
      auto input = std::make_shared<DatagramInput>(state->io, ports[i], i, handler);
      RETURN_IF_ERROR(input->open(state->io, allowed));
      state->datagrams.push_back(std::move(input));
    }
  }
  return std::unique_ptr<LiveReceiver>(new LiveReceiver(std::move(state)));
}

void LiveReceiver::start() {
  CHECK(!state_->thread.joinable());
  for (const auto& input : state_->datagrams) input->start();
  for (const auto& input : state_->connections) input->start();
  state_->tick();
  state_->thread = std::thread([state = state_.get()] { state->run(); });
}

void LiveReceiver::stop() {
  if (!state_->thread.joinable()) return;
  asio::post(state_->io, [state = state_.get()] {
    for (const auto& input : state->datagrams) input->close();
    for (const auto& input : state->connections) input->close();
    state->io.stop();
  });
  state_->thread.join();
}

}  // namespace strandcast
