// DatagramSender: sends datagrams to one address. One thread.
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
  /// NotFound when the host is not known.
  static Result<std::unique_ptr<DatagramSender>> open(const Address& to);
  ~DatagramSender();
  DatagramSender(const DatagramSender&) = delete;
  DatagramSender& operator=(const DatagramSender&) = delete;

  /// False when it could not be handed to the network; nobody tells whether it arrives.
  bool send(std::span<const std::byte> bytes);

 private:
  struct State;
  explicit DatagramSender(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace strandcast
