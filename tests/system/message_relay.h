// SPDX-License-Identifier: Apache-2.0
// Stands between a device and its host with the keys of both, so that a test can double and reorder their messages.
#pragma once

#include "common/keys/keys.h"

#include <zmq.hpp>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>

namespace gyre {

class ConnectionMonitor;

// For one device at a time: a new connection of it ends the one before.
class MessageRelay {
 public:
  // host_endpoint: where the real host is. on_lost is called, from a thread of the relay's own, when the host's end is
  // lost.
  MessageRelay(const KeyPair& host, const KeyPair& device, std::string host_endpoint, unsigned seed,
               std::function<void()> on_lost);
  ~MessageRelay();
  MessageRelay(const MessageRelay&) = delete;
  MessageRelay& operator=(const MessageRelay&) = delete;

  int port() const { return port_; }
  // So many of the next messages may be sent twice, or be kept back until another has passed.
  void double_next(int messages) { doubling_ = messages; }
  void reorder_next(int messages) { reordering_ = messages; }

 private:
  using Send = std::function<void(const std::string& bytes)>;
  struct Way {
    std::optional<std::string> kept_back;
  };

  void relay();
  void from_device();
  void from_host();
  void pass(Way& way, std::string bytes, const Send& send);
  void connect_to_host();
  bool chance(std::atomic<int>& left);
  void release(Way& way, const Send& send);
  void send_up(const std::string& bytes);
  void send_down(const std::string& bytes);

  KeyPair host_, device_;
  std::string host_endpoint_;
  std::mt19937 random_;
  std::function<void()> on_lost_;
  zmq::context_t context_;
  zmq::socket_t front_;
  std::unique_ptr<zmq::socket_t> back_;
  std::unique_ptr<ConnectionMonitor> monitor_;
  std::string peer_;  // the device's connection
  Way up_, down_;
  int port_ = 0;
  std::atomic<int> doubling_{0}, reordering_{0};
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace gyre
