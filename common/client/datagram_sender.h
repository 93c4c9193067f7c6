// DatagramSender: sends UDP datagrams to one address. One thread.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "common/base/result.h"
#include "common/client/address.h"

namespace strandcast {

class DatagramSender {
 public:
  /// Opens a socket to the address; NotFound if the host is unknown.
  static Result<std::unique_ptr<DatagramSender>> open(const Address& to);
  ~DatagramSender();
  DatagramSender(const DatagramSender&) = delete;
  DatagramSender& operator=(const DatagramSender&) = delete;

  /// Sends a datagram without waiting; returns false if the network did not take it. Arrival is not
  /// confirmed.
  bool send(std::span<const std::byte> bytes);

 private:
  struct State;
  explicit DatagramSender(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
