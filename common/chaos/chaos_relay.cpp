#include "common/chaos/chaos_relay.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <list>
#include <mutex>
#include <thread>
#include <utility>

#include "common/base/profile.h"
#include "common/base/units.h"
#include "common/chaos/chaos_pipe.h"

namespace strandcast::chaos {
namespace {
/// Kernel buffers on both sides of the relay: small, so that what is queued is queued where it is measured.
constexpr int kSocketBufferBytes = 64 << 10;
constexpr size_t kReadBytes = 64u << 10;
constexpr int kBacklog = 128;
constexpr int64_t kLongestSleepUs = 50'000;
/// Pause after a failed accept: no file descriptors left, most likely.
constexpr int64_t kAcceptPauseUs = 100'000;
constexpr uint64_t kSeedStep = 0x9e3779b97f4a7c15ull;

int64_t now_us() {
  return now_ns() / kUsInNs;
}

/// A file descriptor that closes itself.
class Socket {
 public:
  explicit Socket(int descriptor = -1) : descriptor_(descriptor) {}
  Socket(Socket&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
  Socket& operator=(Socket&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    return *this;
  }
  ~Socket() { close(); }
  int get() const { return descriptor_; }
  bool is_open() const { return descriptor_ >= 0; }
  void close() {
    if (descriptor_ >= 0) ::close(std::exchange(descriptor_, -1));
  }
  void set(int level, int name, int value) const {
    setsockopt(descriptor_, level, name, &value, sizeof value);
  }
  void set_up() const {
    fcntl(descriptor_, F_SETFL, fcntl(descriptor_, F_GETFL) | O_NONBLOCK);
    set(IPPROTO_TCP, TCP_NODELAY, 1);
    set(SOL_SOCKET, SO_RCVBUF, kSocketBufferBytes);
    set(SOL_SOCKET, SO_SNDBUF, kSocketBufferBytes);
  }
  /// The peer sees a reset instead of an end.
  void reset() {
    const linger now{1, 0};
    setsockopt(descriptor_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
    close();
  }

 private:
  int descriptor_;
};

struct AddressInfo {
  addrinfo* list = nullptr;
  AddressInfo() = default;
  AddressInfo(const AddressInfo&) = delete;
  AddressInfo& operator=(const AddressInfo&) = delete;
  ~AddressInfo() {
    if (list != nullptr) freeaddrinfo(list);
  }
  Status find(const std::string& host, uint16_t port) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    hints.ai_flags = AI_NUMERICSERV;
    if (const int failure = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &list);
        failure != 0)
      return make_error(ErrorCode::BadInput, "cannot find host '{}': {}", host, gai_strerror(failure));
    return {};
  }
};

/// One direction: from one socket through the pipe into the other.
struct Flow {
  Flow(Direction way, const LinkPlan& plan, uint64_t seed) : direction(way), pipe(plan, seed) {}
  Direction direction;
  ChaosPipe pipe;
  bool is_read_end = false;   // the sender has closed
  bool is_write_end = false;  // and the receiver knows
  bool is_blocked = false;    // the receiver's kernel buffer is full
  bool is_silent = false;
  uint64_t read_bytes = 0;
};

struct Link {
  Link(const RelayConfig& config, uint64_t seed)
      : up(Direction::Up, config.up, seed), down(Direction::Down, config.down, seed + kSeedStep / 2) {}
  Socket client, server;
  Flow up, down;
  bool is_connecting = true;
  bool is_dead = false;
};

}  // namespace

class ChaosRelay::State {
 public:
  explicit State(const RelayConfig& config) : config_(config) {}
  ~State() {
    {
      const std::lock_guard lock(mutex_);
      is_stopping_ = true;
    }
    wake();
    if (thread_.joinable()) thread_.join();
  }

  Status open() {
    AddressInfo address;
    RETURN_IF_ERROR(address.find(config_.listen_host, config_.listen_port));
    // The target's host is looked up once, so a wrong name is told at once.
    AddressInfo target;
    RETURN_IF_ERROR(target.find(config_.to_host, config_.to_port));
    std::memcpy(&target_, target.list->ai_addr, target.list->ai_addrlen);
    target_size_ = target.list->ai_addrlen;
    listener_ = Socket(socket(address.list->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    listener_.set(SOL_SOCKET, SO_REUSEADDR, 1);
    listener_.set_up();
    if (bind(listener_.get(), address.list->ai_addr, address.list->ai_addrlen) != 0 ||
        listen(listener_.get(), kBacklog) != 0)
      return make_error(ErrorCode::Unavailable, "cannot listen on {} port {}: {}", config_.listen_host,
                        config_.listen_port, std::strerror(errno));
    sockaddr_storage own{};
    socklen_t size = sizeof own;
    getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&own), &size);
    port_ = ntohs(own.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(own).sin6_port
                                            : reinterpret_cast<sockaddr_in&>(own).sin_port);
    wake_ = Socket(eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC));
    thread_ = std::thread([this] { run(); });
    return {};
  }

  uint16_t port() const { return port_; }

  /// Changes what the relay does, between two of its turns.
  template <class Change>
  void change(Change change) {
    {
      const std::lock_guard lock(mutex_);
      change(*this);
    }
    wake();
  }

  RelayCounters counters() const {
    const std::lock_guard lock(mutex_);
    return counters_;
  }

  // Under mutex_.
  RelayConfig config_;
  bool is_frozen_ = false;
  bool is_silent_ = false;
  bool is_reset_wanted_ = false;
  bool has_new_plan_ = false;
  uint16_t new_port_ = 0;

 private:
  void wake() {
    const uint64_t one = 1;
    if (wake_.is_open() && write(wake_.get(), &one, sizeof one) < 0 && errno != EAGAIN) return;
  }

  void run() {
    while (true) {
      {
        const std::lock_guard lock(mutex_);
        if (is_stopping_) return;
        apply_changes();
        const int64_t time_us = now_us();
        for (Link& link : links_) move(link, time_us);
        links_.remove_if([](const Link& link) { return link.is_dead; });
        counters_.open_connections = links_.size();
      }
      sleep();
      const std::lock_guard lock(mutex_);
      accept_new();
    }
  }

  void apply_changes() {
    if (std::exchange(has_new_plan_, false))
      for (Link& link : links_) {
        link.up.pipe.set_plan(config_.up);
        link.down.pipe.set_plan(config_.down);
      }
    if (std::exchange(is_reset_wanted_, false))
      for (Link& link : links_) reset(link);
    if (const uint16_t port = htons(std::exchange(new_port_, 0)); port != 0)
      (target_.ss_family == AF_INET6 ? reinterpret_cast<sockaddr_in6&>(target_).sin6_port
                                     : reinterpret_cast<sockaddr_in&>(target_).sin_port) = port;
  }

  void accept_new() {
    while (now_us() >= accept_after_us_) {
      Socket client(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!client.is_open()) {
        if (errno != EAGAIN && errno != EINTR) accept_after_us_ = now_us() + kAcceptPauseUs;
        return;
      }
      client.set_up();
      const uint64_t seed = config_.seed + kSeedStep * ++counters_.connections;
      Link& link = links_.emplace_back(config_, seed);
      link.client = std::move(client);
      if (!is_silent_) connect(link);
    }
  }

  void connect(Link& link) {
    link.server = Socket(socket(target_.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0));
    link.server.set_up();
    const int result =
        ::connect(link.server.get(), reinterpret_cast<const sockaddr*>(&target_), target_size_);
    if (result != 0 && errno != EINPROGRESS) refuse(link);
  }

  void refuse(Link& link) {
    ++counters_.refused;
    link.client.reset();
    link.is_dead = true;
  }

  void reset(Link& link) {
    ++counters_.resets;
    if (link.client.is_open()) link.client.reset();
    if (link.server.is_open()) link.server.reset();
    link.is_dead = true;
  }

  /// Everything that can be done for a connection without waiting.
  void move(Link& link, int64_t time_us) {
    if (link.is_dead || is_frozen_) return;
    if (link.is_connecting && link.server.is_open()) {
      pollfd ready{link.server.get(), POLLOUT, 0};
      if (poll(&ready, 1, 0) <= 0) return;
      int failure = 0;
      socklen_t size = sizeof failure;
      getsockopt(link.server.get(), SOL_SOCKET, SO_ERROR, &failure, &size);
      if (failure != 0) return refuse(link);
      link.is_connecting = false;
    }
    move(link, link.up, link.client, link.server, time_us);
    if (!link.is_dead) move(link, link.down, link.server, link.client, time_us);
    if (link.up.is_write_end && link.down.is_write_end) link.is_dead = true;
  }

  void move(Link& link, Flow& flow, Socket& from, Socket& to, int64_t time_us) {
    if (from.is_open() && !flow.is_read_end) take_in(link, flow, from, time_us);
    if (link.is_dead) return;
    if (to.is_open() && !flow.is_write_end) give_out(link, flow, to, time_us);
  }

  void take_in(Link& link, Flow& flow, Socket& from, int64_t time_us) {
    const auto side = static_cast<size_t>(flow.direction);
    while (true) {
      const bool is_swallowed = is_silent_ || flow.is_silent;
      const size_t room = is_swallowed ? kReadBytes : std::min(flow.pipe.room(time_us), kReadBytes);
      if (room == 0) return;
      const ssize_t size = recv(from.get(), buffer_.data(), room, 0);
      if (size < 0) {
        // A reset on one side is passed on as one, unless the line is dead.
        if (errno != EAGAIN && errno != EINTR && !is_swallowed) reset(link);
        return;
      }
      if (size == 0) {
        flow.is_read_end = !is_swallowed;
        flow.is_silent |= is_swallowed;
        return;
      }
      const auto bytes = std::span(buffer_).first(static_cast<size_t>(size));
      if (is_swallowed) {
        counters_.swallowed_bytes[side] += bytes.size();
        continue;
      }
      const uint64_t corrupted = flow.pipe.corrupted_bytes();
      flow.pipe.push(bytes, time_us);
      counters_.corrupted_bytes[side] += flow.pipe.corrupted_bytes() - corrupted;
      counters_.most_queued_bytes = std::max<uint64_t>(counters_.most_queued_bytes, flow.pipe.held_bytes());
      flow.read_bytes += bytes.size();
      const LinkPlan& plan = flow.pipe.plan();
      if (plan.reset_after_bytes > 0 && flow.read_bytes >= plan.reset_after_bytes) return reset(link);
      if (plan.silent_after_bytes > 0 && flow.read_bytes >= plan.silent_after_bytes)
        link.up.is_silent = link.down.is_silent = true;
    }
  }

  void give_out(Link& link, Flow& flow, Socket& to, int64_t time_us) {
    const bool is_swallowed = is_silent_ || flow.is_silent;
    flow.is_blocked = false;
    while (true) {
      const std::span<const std::byte> piece = flow.pipe.front(time_us);
      if (piece.empty()) break;
      ssize_t size = static_cast<ssize_t>(piece.size());
      if (!is_swallowed) size = send(to.get(), piece.data(), piece.size(), MSG_NOSIGNAL);
      if (size < 0) {
        flow.is_blocked = errno == EAGAIN || errno == EINTR;
        if (!flow.is_blocked) reset(link);
        return;
      }
      auto& counter = is_swallowed ? counters_.swallowed_bytes : counters_.bytes;
      counter[static_cast<size_t>(flow.direction)] += static_cast<uint64_t>(size);
      flow.pipe.pop(static_cast<size_t>(size));
    }
    if (flow.is_read_end && flow.pipe.is_empty() && !is_swallowed) {
      shutdown(to.get(), SHUT_WR);
      flow.is_write_end = true;
    }
  }

  /// Waits for sockets, the next due piece or a change.
  void sleep() {
    std::vector<pollfd> waits{{wake_.get(), POLLIN, 0}};
    const int64_t time_us = now_us();
    if (time_us >= accept_after_us_) waits.push_back({listener_.get(), POLLIN, 0});
    int64_t sleep_us = kLongestSleepUs;
    {
      const std::lock_guard lock(mutex_);
      for (const Link& link : links_) {
        if (is_frozen_) break;
        add_waits(waits, link, time_us);
        for (const Flow* flow : {&link.up, &link.down}) {
          const int64_t due_us = flow->pipe.next_due_us(time_us);
          if (due_us >= 0 && !flow->is_blocked) sleep_us = std::min(sleep_us, due_us - time_us);
        }
      }
    }
    const timespec limit{0, std::max<int64_t>(sleep_us, 0) * kUsInNs};
    ppoll(waits.data(), waits.size(), &limit, nullptr);
    uint64_t ignored = 0;
    while (read(wake_.get(), &ignored, sizeof ignored) > 0) continue;
  }

  void add_waits(std::vector<pollfd>& waits, const Link& link, int64_t time_us) const {
    const auto events = [&](const Flow& in, const Flow& out) {
      const bool is_swallowed = is_silent_ || in.is_silent;
      const bool wants_read = !in.is_read_end && (is_swallowed || in.pipe.room(time_us) > 0);
      return static_cast<short>((wants_read ? POLLIN : 0) | (out.is_blocked ? POLLOUT : 0));
    };
    if (link.is_connecting && link.server.is_open()) {
      waits.push_back({link.server.get(), POLLOUT, 0});
      return;
    }
    if (const short wanted = events(link.up, link.down); wanted != 0)
      waits.push_back({link.client.get(), wanted, 0});
    if (const short wanted = events(link.down, link.up); wanted != 0 && link.server.is_open())
      waits.push_back({link.server.get(), wanted, 0});
  }

  mutable std::mutex mutex_;
  bool is_stopping_ = false;
  RelayCounters counters_;
  std::list<Link> links_;

  Socket listener_;
  Socket wake_;
  uint16_t port_ = 0;
  sockaddr_storage target_{};
  socklen_t target_size_ = 0;
  int64_t accept_after_us_ = 0;
  std::array<std::byte, kReadBytes> buffer_{};
  std::thread thread_;
};

ChaosRelay::ChaosRelay(std::unique_ptr<State> state) : state_(std::move(state)) {}
ChaosRelay::~ChaosRelay() = default;

Result<std::unique_ptr<ChaosRelay>> ChaosRelay::start(const RelayConfig& config) {
  auto state = std::make_unique<State>(config);
  RETURN_IF_ERROR(state->open());
  return std::unique_ptr<ChaosRelay>(new ChaosRelay(std::move(state)));
}

uint16_t ChaosRelay::port() const {
  return state_->port();
}
void ChaosRelay::set_plan(Direction direction, const LinkPlan& plan) {
  state_->change([&](State& state) {
    (direction == Direction::Up ? state.config_.up : state.config_.down) = plan;
    state.has_new_plan_ = true;
  });
}
void ChaosRelay::set_frozen(bool is_frozen) {
  state_->change([&](State& state) { state.is_frozen_ = is_frozen; });
}
void ChaosRelay::set_silent(bool is_silent) {
  state_->change([&](State& state) { state.is_silent_ = is_silent; });
}
void ChaosRelay::reset_all() {
  state_->change([](State& state) { state.is_reset_wanted_ = true; });
}
void ChaosRelay::set_to_port(uint16_t port) {
  state_->change([&](State& state) { state.new_port_ = port; });
}
RelayCounters ChaosRelay::counters() const {
  return state_->counters();
}

}  // namespace strandcast::chaos
