// The network between machines of the world: TCP connections over links with rate, delay and jitter, which
// stall, fall silent and break. Files are what a program holds: sockets, and what Asio waits with. No real
// file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/vopr/world.h"

namespace strandcast::vopr {

/// Between two machines, the same both ways.
struct LinkQuality {
  double bytes_per_s = 12.5e6;
  int64_t delay_ns = 1 * kMs;
  int64_t jitter_ns = 0;
};

struct Endpoint {
  NodeId node = kFate;
  uint16_t port = 0;
  auto operator<=>(const Endpoint&) const = default;
};

class Epoll;

class File {
 public:
  virtual ~File() = default;
  /// EPOLLIN and so on, that are so now.
  virtual uint32_t readiness() const { return 0; }
  virtual void closed() {}
  /// Something has become so.
  void tell();

  std::vector<Epoll*> watchers;
  int number = -1;
  bool is_nonblocking = false;
};

class Socket : public File, public std::enable_shared_from_this<Socket> {
 public:
  enum class Phase { Fresh, Listening, Connecting, Open, Failed };
  uint32_t readiness() const override;
  void closed() override;
  int connect_to(const Endpoint& to);
  /// Bytes taken, or -1 with errno.
  ssize_t send(const char* bytes, size_t size);
  ssize_t receive(char* bytes, size_t size, bool is_peeking);
  void end_sending();
  /// As if the other side had said RST.
  void reset(int error);
  size_t untaken_bytes() const { return on_way_bytes_; }

  Phase phase = Phase::Fresh;
  Endpoint local, remote;
  std::deque<std::shared_ptr<Socket>> waiting;  // to be accepted
  int error = 0;
  size_t send_buffer_bytes = 256u << 10;
  size_t unsent_limit_bytes = ~size_t{0};
  bool is_silent = false;  // nothing gets through any more, and nobody is told

 private:
  friend class Network;
  bool has_room() const;
  size_t unsent_bytes() const;
  void arrive(std::string bytes, bool is_end);
  void take_held();

  std::weak_ptr<Socket> peer_;
  std::string received_;
  size_t read_ = 0;               // of those
  std::deque<std::string> held_;  // on their way, but the buffer there is full
  bool wants_room_ = false;       // somebody could not send all
  bool has_ended_ = false, is_end_held_ = false, has_sent_end_ = false, is_reset_ = false, is_closed_ = false;
  size_t on_way_bytes_ = 0;  // to the peer
  int64_t last_arrival_ns_ = 0;
};

class Counter : public File {  // eventfd
 public:
  uint32_t readiness() const override;
  uint64_t value = 0;
};

class Timer : public File {  // timerfd
 public:
  uint32_t readiness() const override;
  void set(int64_t due_ns);
  int64_t due_ns = kNever;
  uint64_t setting = 0;
};

class Epoll : public File {
 public:
  struct Watch {
    std::weak_ptr<File> file;
    uint32_t events = 0;
    uint64_t data = 0;
    bool is_pending = false;
  };
  std::map<int, Watch> watches;
};

class Network {
 public:
  static Network& get();

  int add(std::shared_ptr<File> file);
  std::shared_ptr<File> find(int number) const;
  void close(int number);

  void set_link(NodeId a, NodeId b, const LinkQuality& quality);
  const LinkQuality& link(NodeId a, NodeId b);
  /// Nothing arrives before that time, and nothing is lost.
  void stall(NodeId a, NodeId b, int64_t until_ns);
  /// Connections of now between the two never get anything through again; new ones do.
  void silence(NodeId a, NodeId b);
  /// Connections of now break.
  void reset(NodeId a, NodeId b);
  /// All of a machine break, and nobody listens there.
  void pull_plug(NodeId node);

  int listen(const std::shared_ptr<Socket>& socket);
  uint16_t free_port(NodeId node);
  /// When so many bytes that are sent now arrive.
  int64_t arrival_ns(NodeId from, NodeId to, size_t bytes);
  int64_t busy_until_ns(NodeId from, NodeId to);
  void reach(const std::shared_ptr<Socket>& from, const Endpoint& to);

  uint64_t delivered_bytes = 0;
  uint64_t opened = 0;

 private:
  struct Way {
    int64_t busy_until_ns = 0;
  };
  struct Link {
    LinkQuality quality;
    int64_t stalled_until_ns = 0;
  };
  Link& link_of(NodeId a, NodeId b);
  template <class Work>
  void for_sockets(Work work);
  void answer(const std::shared_ptr<Socket>& from, const Endpoint& to);

  std::map<int, std::shared_ptr<File>> files_;
  int next_number_ = 1 << 20;
  std::map<Endpoint, std::weak_ptr<Socket>> listeners_;
  std::map<std::pair<NodeId, NodeId>, Link> links_;
  std::map<std::pair<NodeId, NodeId>, Way> ways_;
  std::map<NodeId, uint16_t> ports_;
};

}  // namespace strandcast::vopr
