#include "tests/vopr/net.h"

#include <sys/epoll.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace strandcast::vopr {
namespace {

constexpr size_t kReceiveBufferBytes = 256u << 10;
constexpr int64_t kLocalDelayNs = 20 * kUs;
constexpr int64_t kConnectTimeNs = 127 * kS;  // Linux: tcp_syn_retries 6
constexpr uint16_t kFirstFreePort = 40'000;

std::pair<NodeId, NodeId> pair_of(NodeId a, NodeId b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

void File::tell() {
  for (Epoll* epoll : watchers) {
    const auto watch = epoll->watches.find(number);
    if (watch == epoll->watches.end()) continue;
    watch->second.is_pending = true;
    world::wake_all(epoll);
  }
}

uint32_t Counter::readiness() const {
  return (value > 0 ? EPOLLIN : 0u) | EPOLLOUT;
}

uint32_t Timer::readiness() const {
  return due_ns <= world::time_ns() ? uint32_t{EPOLLIN} : 0u;
}

void Timer::set(int64_t time_ns) {
  due_ns = time_ns;
  const uint64_t own = ++setting;
  if (due_ns == kNever) return;
  if (due_ns <= world::time_ns()) return tell();
  const auto network = &Network::get();
  world::at(due_ns, [network, file = number, own] {
    const auto timer = std::dynamic_pointer_cast<Timer>(network->find(file));
    if (timer != nullptr && timer->setting == own) timer->tell();
  });
}

// ---- sockets ----

uint32_t Socket::readiness() const {
  uint32_t ready = 0;
  if (phase == Phase::Listening && !waiting.empty()) ready |= EPOLLIN;
  if (phase == Phase::Failed || is_reset_) ready |= EPOLLIN | EPOLLOUT | EPOLLERR | EPOLLHUP;
  if (phase == Phase::Fresh) ready |= EPOLLOUT | EPOLLHUP;
  if (phase != Phase::Open) return ready;
  if (read_ < received_.size() || has_ended_) ready |= EPOLLIN;
  if (has_room()) ready |= EPOLLOUT;
  if (has_ended_) ready |= EPOLLRDHUP;
  if (has_ended_ && has_sent_end_) ready |= EPOLLHUP;
  return ready;
}

size_t Socket::unsent_bytes() const {
  Network& network = Network::get();
  const int64_t busy_ns = network.busy_until_ns(local.node, remote.node) - world::time_ns();
  if (busy_ns <= 0) return 0;
  const double bytes =
      static_cast<double>(busy_ns) * 1e-9 * network.link(local.node, remote.node).bytes_per_s;
  return std::min(on_way_bytes_, static_cast<size_t>(bytes));
}

bool Socket::has_room() const {
  return on_way_bytes_ < send_buffer_bytes && unsent_bytes() < unsent_limit_bytes;
}

int Socket::connect_to(const Endpoint& to) {
  phase = Phase::Connecting;
  remote = to;
  if (local.port == 0) local = {world::node(), Network::get().free_port(world::node())};
  Network::get().reach(shared_from_this(), to);
  errno = EINPROGRESS;
  return -1;
}

ssize_t Socket::send(const char* bytes, size_t size) {
  if (is_reset_ || phase != Phase::Open || has_sent_end_) {
    errno = is_reset_ ? std::exchange(error, 0) : 0;
    if (errno == 0) errno = EPIPE;
    return -1;
  }
  if (!has_room()) {
    wants_room_ = true;
    errno = EAGAIN;
    return -1;
  }
  const size_t wanted = size;
  size = std::min({size, send_buffer_bytes - on_way_bytes_, unsent_limit_bytes});
  wants_room_ = size < wanted;
  on_way_bytes_ += size;
  if (is_silent) return static_cast<ssize_t>(size);
  last_arrival_ns_ = std::max(last_arrival_ns_, Network::get().arrival_ns(local.node, remote.node, size));
  world::at(last_arrival_ns_, [self = shared_from_this(), text = std::string(bytes, size)]() mutable {
    const auto peer = self->peer_.lock();
    if (peer == nullptr || peer->is_closed_) {
      self->reset(ECONNRESET);
    } else {
      peer->arrive(std::move(text), false);
    }
  });
  return static_cast<ssize_t>(size);
}

void Socket::end_sending() {
  if (phase != Phase::Open || std::exchange(has_sent_end_, true) || is_silent || is_reset_) return;
  last_arrival_ns_ = std::max(last_arrival_ns_, Network::get().arrival_ns(local.node, remote.node, 0));
  world::at(last_arrival_ns_, [self = shared_from_this()] {
    if (const auto peer = self->peer_.lock(); peer != nullptr && !peer->is_closed_) peer->arrive({}, true);
  });
  if (has_ended_) tell();
}

/// While no thread runs, or on the thread that reads.
void Socket::arrive(std::string bytes, bool is_end) {
  if (is_silent || is_reset_) return;
  if (is_end) {
    is_end_held_ = true;
  } else {
    held_.push_back(std::move(bytes));
  }
  take_held();
}

void Socket::take_held() {
  const auto peer = peer_.lock();
  bool has_news = false;
  while (!held_.empty() && received_.size() - read_ < kReceiveBufferBytes) {
    const size_t size = held_.front().size();
    received_ += held_.front();
    held_.pop_front();
    Network::get().delivered_bytes += size;
    has_news = true;
    if (peer == nullptr) continue;
    peer->on_way_bytes_ -= std::min(size, peer->on_way_bytes_);
    if (peer->wants_room_ && peer->has_room()) {
      peer->wants_room_ = false;
      peer->tell();
    }
  }
  if (held_.empty() && is_end_held_ && !has_ended_) has_ended_ = has_news = true;
  if (has_news) tell();
}

ssize_t Socket::receive(char* bytes, size_t size, bool is_peeking) {
  if (phase == Phase::Connecting || phase == Phase::Fresh) {
    errno = phase == Phase::Fresh ? ENOTCONN : EAGAIN;
    return -1;
  }
  const size_t there = received_.size() - read_;
  if (there == 0 && is_reset_ && error != 0) {
    errno = std::exchange(error, 0);
    return -1;
  }
  if (there == 0 && (has_ended_ || is_reset_)) return 0;
  if (there == 0) {
    errno = EAGAIN;
    return -1;
  }
  size = std::min(size, there);
  std::memcpy(bytes, received_.data() + read_, size);
  if (is_peeking) return static_cast<ssize_t>(size);
  read_ += size;
  if (read_ == received_.size()) {
    received_.clear();
    read_ = 0;
  }
  if (!held_.empty() || is_end_held_) take_held();
  return static_cast<ssize_t>(size);
}

void Socket::reset(int why) {
  if (std::exchange(is_reset_, true)) return;
  error = why;
  if (phase == Phase::Connecting) phase = Phase::Failed;
  tell();
}

void Socket::closed() {
  is_closed_ = true;
  // Bytes that nobody has read make the end a reset (RFC 1122, section 4.2.2.13).
  const bool is_rude = read_ < received_.size();
  if (phase == Phase::Open && is_rude && !is_silent) {
    const auto peer = peer_.lock();
    if (peer != nullptr)
      world::at(Network::get().arrival_ns(local.node, remote.node, 0), [peer] { peer->reset(ECONNRESET); });
  } else {
    end_sending();
  }
  for (const auto& one : waiting) one->closed();
  waiting.clear();
}

// ---- the network ----

Network& Network::get() {
  static Network* const kept = new Network;
  return *kept;
}

int Network::add(std::shared_ptr<File> file) {
  file->number = next_number_++;
  files_[file->number] = file;
  return file->number;
}

std::shared_ptr<File> Network::find(int number) const {
  const auto found = files_.find(number);
  return found == files_.end() ? nullptr : found->second;
}

void Network::close(int number) {
  const auto file = find(number);
  if (file == nullptr) return;
  for (Epoll* epoll : file->watchers) epoll->watches.erase(number);
  file->watchers.clear();
  if (auto* const epoll = dynamic_cast<Epoll*>(file.get()))
    for (auto& [other, watch] : epoll->watches)
      if (const auto watched = watch.file.lock()) std::erase(watched->watchers, epoll);
  files_.erase(number);
  file->closed();
}

Network::Link& Network::link_of(NodeId a, NodeId b) {
  return links_[pair_of(a, b)];
}
void Network::set_link(NodeId a, NodeId b, const LinkQuality& quality) {
  link_of(a, b).quality = quality;
}
const LinkQuality& Network::link(NodeId a, NodeId b) {
  return link_of(a, b).quality;
}
void Network::stall(NodeId a, NodeId b, int64_t until_ns) {
  link_of(a, b).stalled_until_ns = until_ns;
}

template <class Work>
void Network::for_sockets(Work work) {
  std::vector<std::shared_ptr<Socket>> sockets;
  for (const auto& [number, file] : files_)
    if (auto socket = std::dynamic_pointer_cast<Socket>(file)) sockets.push_back(std::move(socket));
  for (const auto& socket : sockets) work(socket);
}

void Network::silence(NodeId a, NodeId b) {
  for_sockets([&](const auto& socket) {
    if (socket->phase == Socket::Phase::Open &&
        pair_of(socket->local.node, socket->remote.node) == pair_of(a, b))
      socket->is_silent = true;
  });
}

void Network::reset(NodeId a, NodeId b) {
  for_sockets([&](const auto& socket) {
    if (socket->phase == Socket::Phase::Open &&
        pair_of(socket->local.node, socket->remote.node) == pair_of(a, b))
      socket->reset(ECONNRESET);
  });
}

void Network::pull_plug(NodeId node) {
  std::erase_if(listeners_, [&](const auto& entry) { return entry.first.node == node; });
  for_sockets([&](const auto& socket) {
    using Phase = Socket::Phase;
    const bool is_there = socket->local.node == node || socket->remote.node == node;
    if (is_there && (socket->phase == Phase::Open || socket->phase == Phase::Connecting))
      socket->reset(ECONNRESET);
  });
}

int Network::listen(const std::shared_ptr<Socket>& socket) {
  const auto there = listeners_.find(socket->local);
  if (there != listeners_.end() && !there->second.expired()) {
    errno = EADDRINUSE;
    return -1;
  }
  socket->phase = Socket::Phase::Listening;
  listeners_[socket->local] = socket;
  return 0;
}

uint16_t Network::free_port(NodeId node) {
  uint16_t& port = ports_[node];
  if (port < kFirstFreePort) port = kFirstFreePort;
  return port++;
}

int64_t Network::busy_until_ns(NodeId from, NodeId to) {
  return ways_[{from, to}].busy_until_ns;
}

int64_t Network::arrival_ns(NodeId from, NodeId to, size_t bytes) {
  if (from == to) return world::time_ns() + kLocalDelayNs;
  const Link& link = link_of(from, to);
  Way& way = ways_[{from, to}];
  const auto takes_ns = static_cast<int64_t>(static_cast<double>(bytes) / link.quality.bytes_per_s * 1e9);
  way.busy_until_ns = std::max({way.busy_until_ns, world::time_ns(), link.stalled_until_ns}) + takes_ns;
  const int64_t jitter_ns =
      link.quality.jitter_ns > 0 ? world::random().between(0, link.quality.jitter_ns) : 0;
  return way.busy_until_ns + link.quality.delay_ns + jitter_ns;
}

void Network::reach(const std::shared_ptr<Socket>& from, const Endpoint& to) {
  world::at(arrival_ns(from->local.node, to.node, 0), [this, from, to] { answer(from, to); });
  world::at(world::time_ns() + kConnectTimeNs, [from] {
    if (from->phase != Socket::Phase::Connecting) return;
    from->error = ETIMEDOUT;
    from->phase = Socket::Phase::Failed;
    from->tell();
  });
}

/// Where somebody listens, the connection is there when the answer has come back.
void Network::answer(const std::shared_ptr<Socket>& from, const Endpoint& to) {
  const auto found = listeners_.find(to);
  const auto listener = found == listeners_.end() ? nullptr : found->second.lock();
  const bool is_there = listener != nullptr && !listener->is_closed_;
  std::shared_ptr<Socket> made;
  if (is_there) {
    made = std::make_shared<Socket>();
    made->phase = Socket::Phase::Open;
    made->local = to;
    made->remote = from->local;
    made->peer_ = from;
    from->peer_ = made;
    listener->waiting.push_back(made);
    listener->tell();
    ++opened;
  }
  world::at(arrival_ns(to.node, from->local.node, 0), [from, made] {
    if (made != nullptr && from->is_closed_) return made->reset(ECONNRESET);
    if (from->phase != Socket::Phase::Connecting) return;
    from->phase = made != nullptr ? Socket::Phase::Open : Socket::Phase::Failed;
    from->error = made != nullptr ? 0 : ECONNREFUSED;
    from->tell();
  });
}

}  // namespace strandcast::vopr
