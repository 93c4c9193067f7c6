// The C library's sockets, epoll, eventfd, timerfd and names of hosts, as this program has them. Numbers of
// files that are no file of the network's lead to the C library's own functions.
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/sockios.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/uio.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>

#include "tests/vopr/disk.h"
#include "tests/vopr/net.h"
#include "tests/vopr/threads_private.h"

#define CALL extern "C" __attribute__((visibility("default")))

namespace {

using namespace strandcast::vopr;  // of this file alone: all of it is about them

constexpr uint32_t kNetOf10 = 10u << 24;
constexpr int kFirstNumber = 1 << 20;

bool is_ours(int number) {
  return number >= kFirstNumber;
}
std::shared_ptr<File> file_of(int number) {
  return Network::get().find(number);
}
std::shared_ptr<Socket> socket_of(int number) {
  auto socket = std::dynamic_pointer_cast<Socket>(file_of(number));
  if (socket == nullptr) errno = EBADF;
  return socket;
}

/// Machine N is 10.0.0.N.
Endpoint endpoint_of(const sockaddr* address) {
  sockaddr_in in{};
  std::memcpy(&in, address, sizeof(in));
  return {ntohl(in.sin_addr.s_addr) - kNetOf10, ntohs(in.sin_port)};
}
void put(const Endpoint& endpoint, sockaddr* address, socklen_t* size) {
  sockaddr_in in{};
  in.sin_family = AF_INET;
  in.sin_port = htons(endpoint.port);
  in.sin_addr.s_addr = htonl(kNetOf10 + endpoint.node);
  std::memcpy(address, &in, std::min<size_t>(*size, sizeof(in)));
  *size = sizeof(in);
}

ssize_t send_all(Socket& socket, const iovec* parts, size_t count) {
  ssize_t sent = 0;
  for (size_t i = 0; i < count; ++i) {
    if (parts[i].iov_len == 0) continue;
    const ssize_t size = socket.send(static_cast<const char*>(parts[i].iov_base), parts[i].iov_len);
    if (size < 0) return sent > 0 ? sent : -1;
    sent += size;
    if (static_cast<size_t>(size) < parts[i].iov_len) break;
  }
  return sent;
}

ssize_t receive_all(Socket& socket, const iovec* parts, size_t count, int flags) {
  ssize_t received = 0;
  for (size_t i = 0; i < count; ++i) {
    const ssize_t size =
        socket.receive(static_cast<char*>(parts[i].iov_base), parts[i].iov_len, (flags & MSG_PEEK) != 0);
    if (size <= 0) return received > 0 ? received : size;
    received += size;
    if (static_cast<size_t>(size) < parts[i].iov_len) break;
  }
  return received;
}

ssize_t write_to_disk(ssize_t (*own)(int, const void*, size_t), int number, const void* bytes, size_t size) {
  Disk& disk = Disk::of(world::node());
  if (disk.is_dead()) return static_cast<ssize_t>(size);
  const size_t taken = disk.take(size);
  if (taken == 0 && size > 0 && !disk.is_dead()) {
    errno = ENOSPC;
    return -1;
  }
  const ssize_t written = own(number, bytes, taken);
  return disk.is_dead() ? static_cast<ssize_t>(size) : written;
}

short ready_of(const pollfd& wanted) {
  const auto file = file_of(wanted.fd);
  if (file == nullptr) return POLLNVAL;
  const uint32_t ready = file->readiness();
  return static_cast<short>(ready & (static_cast<uint32_t>(wanted.events) | EPOLLERR | EPOLLHUP));
}

int collect(Epoll& epoll, epoll_event* events, int most) {
  int count = 0;
  for (auto& [number, watch] : epoll.watches) {
    if (count == most) break;
    if (!watch.is_pending) continue;
    const auto file = watch.file.lock();
    const uint32_t ready = file == nullptr ? 0 : file->readiness() & (watch.events | EPOLLERR | EPOLLHUP);
    if (ready == 0 || (watch.events & EPOLLET) != 0) watch.is_pending = false;
    if (ready == 0) continue;
    events[count].events = ready;
    events[count++].data.u64 = watch.data;
  }
  return count;
}

}  // namespace

// ---- sockets ----

CALL int socket(int family, int type, int) noexcept {
  if (family != AF_INET || (type & 0xf) != SOCK_STREAM) {
    errno = EAFNOSUPPORT;
    return -1;
  }
  return Network::get().add(std::make_shared<Socket>());
}

CALL int bind(int number, const sockaddr* address, socklen_t) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  socket->local = endpoint_of(address);
  socket->local.node = world::node();
  if (socket->local.port == 0) socket->local.port = Network::get().free_port(socket->local.node);
  return 0;
}
CALL int listen(int number, int) noexcept {
  const auto socket = socket_of(number);
  return socket == nullptr ? -1 : Network::get().listen(socket);
}
CALL int accept(int number, sockaddr* address, socklen_t* size) {
  const auto listener = socket_of(number);
  if (listener == nullptr) return -1;
  if (listener->waiting.empty()) {
    errno = EAGAIN;
    return -1;
  }
  const auto socket = listener->waiting.front();
  listener->waiting.pop_front();
  if (address != nullptr) put(socket->remote, address, size);
  return Network::get().add(socket);
}
CALL int accept4(int number, sockaddr* address, socklen_t* size, int) {
  return accept(number, address, size);
}
CALL int connect(int number, const sockaddr* address, socklen_t) {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  return socket->connect_to(endpoint_of(address));
}
CALL int shutdown(int number, int how) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  if (how != SHUT_RD) socket->end_sending();
  return 0;
}
CALL int getsockname(int number, sockaddr* address, socklen_t* size) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  put(socket->local, address, size);
  return 0;
}
CALL int getpeername(int number, sockaddr* address, socklen_t* size) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  if (socket->phase != Socket::Phase::Open) {
    errno = ENOTCONN;
    return -1;
  }
  put(socket->remote, address, size);
  return 0;
}
CALL int setsockopt(int number, int level, int name, const void* value, socklen_t) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  int given = 0;
  std::memcpy(&given, value, sizeof(given));
  if (level == SOL_SOCKET && name == SO_SNDBUF) socket->send_buffer_bytes = static_cast<size_t>(given);
  if (level == IPPROTO_TCP && name == TCP_NOTSENT_LOWAT)
    socket->unsent_limit_bytes = static_cast<size_t>(given);
  return 0;
}
CALL int getsockopt(int number, int level, int name, void* value, socklen_t* size) noexcept {
  const auto socket = socket_of(number);
  if (socket == nullptr) return -1;
  std::memset(value, 0, *size);
  if (level == SOL_SOCKET && name == SO_ERROR)
    std::memcpy(value, &socket->error, sizeof(int)), socket->error = 0;
  return 0;
}

CALL ssize_t sendmsg(int number, const msghdr* message, int) {
  const auto socket = socket_of(number);
  return socket == nullptr ? -1 : send_all(*socket, message->msg_iov, message->msg_iovlen);
}
CALL ssize_t recvmsg(int number, msghdr* message, int flags) {
  const auto socket = socket_of(number);
  return socket == nullptr ? -1 : receive_all(*socket, message->msg_iov, message->msg_iovlen, flags);
}
CALL ssize_t send(int number, const void* bytes, size_t size, int) {
  const auto socket = socket_of(number);
  return socket == nullptr ? -1 : socket->send(static_cast<const char*>(bytes), size);
}
CALL ssize_t recv(int number, void* bytes, size_t size, int flags) {
  const auto socket = socket_of(number);
  return socket == nullptr ? -1 : socket->receive(static_cast<char*>(bytes), size, (flags & MSG_PEEK) != 0);
}
CALL ssize_t __recv_chk(int number, void* bytes, size_t size, size_t, int flags) {
  return recv(number, bytes, size, flags);
}

// ---- any file ----

CALL ssize_t write(int number, const void* bytes, size_t size) {
  static const auto own = world::real<ssize_t (*)(int, const void*, size_t)>("write");
  if (!is_ours(number) && (number <= STDERR_FILENO || world::node() == kFate))
    return own(number, bytes, size);
  if (!is_ours(number)) return write_to_disk(own, number, bytes, size);
  const auto file = file_of(number);
  if (auto* const counter = dynamic_cast<Counter*>(file.get())) {
    uint64_t more = 0;
    std::memcpy(&more, bytes, sizeof(more));
    counter->value += more;
    counter->tell();
    return sizeof(more);
  }
  return send(number, bytes, size, 0);
}
CALL ssize_t read(int number, void* bytes, size_t size) {
  static const auto own = world::real<ssize_t (*)(int, void*, size_t)>("read");
  if (!is_ours(number)) return own(number, bytes, size);
  const auto file = file_of(number);
  if (auto* const counter = dynamic_cast<Counter*>(file.get())) {
    if (counter->value == 0) {
      errno = EAGAIN;
      return -1;
    }
    std::memcpy(bytes, &counter->value, sizeof(counter->value));
    counter->value = 0;
    return sizeof(counter->value);
  }
  return recv(number, bytes, size, 0);
}
CALL ssize_t __read_chk(int number, void* bytes, size_t size, size_t) {
  return read(number, bytes, size);
}
CALL int close(int number) {
  static const auto own = world::real<int (*)(int)>("close");
  if (!is_ours(number)) return own(number);
  Network::get().close(number);
  return 0;
}
CALL int ioctl(int number, unsigned long request, ...) noexcept {
  va_list list;
  va_start(list, request);
  void* const given = va_arg(list, void*);
  va_end(list);
  static const auto own = world::real<int (*)(int, unsigned long, ...)>("ioctl");
  if (!is_ours(number)) return own(number, request, given);
  const auto socket = socket_of(number);
  if (request == SIOCOUTQ && socket != nullptr)
    *static_cast<int*>(given) = static_cast<int>(socket->untaken_bytes());
  return 0;
}
CALL int fcntl(int number, int command, ...) {
  va_list list;
  va_start(list, command);
  void* const given = va_arg(list, void*);
  va_end(list);
  static const auto own = world::real<int (*)(int, int, ...)>("fcntl");
  return is_ours(number) ? 0 : own(number, command, given);
}

// ---- waiting for files ----

CALL int poll(pollfd* wanted, nfds_t count, int timeout_ms) {
  static const auto own = world::real<int (*)(pollfd*, nfds_t, int)>("poll");
  if (count > 0 && !is_ours(wanted[0].fd)) return own(wanted, count, timeout_ms);
  const int64_t end_ns = timeout_ms < 0 ? kNever : world::time_ns() + timeout_ms * kMs;
  for (;;) {
    int ready = 0;
    for (nfds_t i = 0; i < count; ++i) ready += (wanted[i].revents = ready_of(wanted[i])) != 0 ? 1 : 0;
    if (ready > 0 || world::time_ns() >= end_ns) return ready;
    world::sleep_until(std::min(end_ns, world::time_ns() + kMs));
  }
}
CALL int __poll_chk(pollfd* wanted, nfds_t count, int timeout_ms, size_t) {
  return poll(wanted, count, timeout_ms);
}
CALL int epoll_create1(int) noexcept {
  return Network::get().add(std::make_shared<Epoll>());
}
CALL int epoll_create(int) noexcept {
  return epoll_create1(0);
}
CALL int epoll_ctl(int number, int operation, int watched, epoll_event* event) noexcept {
  const auto epoll = std::dynamic_pointer_cast<Epoll>(file_of(number));
  const auto file = file_of(watched);
  if (epoll == nullptr || file == nullptr) {
    errno = EBADF;
    return -1;
  }
  if (operation == EPOLL_CTL_DEL) {
    epoll->watches.erase(watched);
    std::erase(file->watchers, epoll.get());
    return 0;
  }
  if (operation == EPOLL_CTL_ADD) file->watchers.push_back(epoll.get());
  epoll->watches[watched] = {file, event->events, event->data.u64, true};
  if ((file->readiness() & event->events) != 0) world::wake_all(epoll.get());
  return 0;
}
CALL int epoll_wait(int number, epoll_event* events, int most, int timeout_ms) {
  const auto epoll = std::dynamic_pointer_cast<Epoll>(file_of(number));
  if (epoll == nullptr) {
    errno = EBADF;
    return -1;
  }
  const int64_t end_ns = timeout_ms < 0 ? kNever : world::time_ns() + timeout_ms * kMs;
  for (;;) {
    const int count = collect(*epoll, events, most);
    if (count > 0 || world::time_ns() >= end_ns) return count;
    world::wait(epoll.get(), end_ns);
  }
}
CALL int eventfd(unsigned value, int) noexcept {
  auto counter = std::make_shared<Counter>();
  counter->value = value;
  return Network::get().add(std::move(counter));
}
CALL int timerfd_create(int, int) noexcept {
  return Network::get().add(std::make_shared<Timer>());
}
CALL int timerfd_settime(int number, int flags, const itimerspec* value, itimerspec*) noexcept {
  const auto timer = std::dynamic_pointer_cast<Timer>(file_of(number));
  if (timer == nullptr) return -1;
  const int64_t given_ns = static_cast<int64_t>(value->it_value.tv_sec) * kS + value->it_value.tv_nsec;
  if (given_ns == 0)
    timer->set(kNever);
  else if ((flags & TFD_TIMER_ABSTIME) != 0)
    timer->set(world::when_monotonic(world::node(), given_ns));
  else
    timer->set(world::time_ns() + given_ns);
  return 0;
}

// ---- names of hosts: machines have numbers ----

CALL int getaddrinfo(const char* host, const char* service, const addrinfo*, addrinfo** result) {
  in_addr address{};
  if (host == nullptr || inet_pton(AF_INET, host, &address) != 1) return EAI_NONAME;
  auto* const info = static_cast<addrinfo*>(std::calloc(1, sizeof(addrinfo) + sizeof(sockaddr_in)));
  auto* const in = reinterpret_cast<sockaddr_in*>(info + 1);
  in->sin_family = AF_INET;
  in->sin_addr = address;
  in->sin_port = htons(static_cast<uint16_t>(service != nullptr ? std::atoi(service) : 0));
  info->ai_family = AF_INET;
  info->ai_socktype = SOCK_STREAM;
  info->ai_protocol = IPPROTO_TCP;
  info->ai_addrlen = sizeof(sockaddr_in);
  info->ai_addr = reinterpret_cast<sockaddr*>(in);
  *result = info;
  return 0;
}
CALL void freeaddrinfo(addrinfo* info) noexcept {
  std::free(info);
}
