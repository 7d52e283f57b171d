// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/ingest_server.h"

#include "common/bundle/sha256.h"
#include "common/wire/link_socket.h"
#include "common/wire/wakeup.h"
#include "offload/ingest/desk.h"
#include "offload/ingest/door.h"
#include "offload/ingest/zap.h"

#include <spdlog/spdlog.h>
#include <array>
#include <map>
#include <mutex>
#include <system_error>
#include <thread>
#include <zmq.hpp>

namespace gyre {

namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds housekeeping_interval{1000};
constexpr int messages_between_posts = 64;  // progress and results overtake a device that never stops sending

// Files of the bundle's root that a finished reconstruction leaves for the device.
constexpr std::array<const char*, 5> result_names = {"avatar.glb", "avatar.vrm", "avatar.fbx", "report.html",
                                                     "report.json"};

// The public key the ZAP handler let in; empty when there was no ZAP handler, which must never be served.
std::string key_of(zmq::message_t& message) {
  try {
    return message.gets("User-Id");
  } catch (const zmq::error_t&) {
    return {};
  }
}

}  // namespace

Result<void> IngestOptions::check() const {
  if (!endpoint.starts_with("tcp://")) return wrong_use("not an endpoint", endpoint, "write it as tcp://*:7410");
  if (!is_public_key(keys.public_key)) return wrong_use("the host has no key pair", "", "make one with the pair verb");
  constexpr std::uint64_t least = 1 << 20;  // a device must always be able to send a chunk while credit is on its way
  if (credit_bytes < least)
    return wrong_use("credit_bytes is too small", std::to_string(credit_bytes), "1 MiB at least");
  return {};
}

// Owns the thread. The socket is used on that thread only; other threads leave posts for it.
class IngestServer::Worker {
 public:
  Worker(IngestOptions options, Store& store, std::function<void(const std::string&)> on_queued)
      : options_(std::move(options)), store_(store), on_queued_(std::move(on_queued)) {}
  ~Worker() { stop(); }

  Result<void> start();
  void stop();
  std::string endpoint() const { return endpoint_; }
  const LinkBoard& board() const { return board_; }

  void post(const wire::StageProgress& progress) {
    const std::lock_guard lock(mutex_);
    progress_[progress.scan] = progress;
    wakeup_.notify();
  }
  void post_finished(const std::string& scan_id) {
    const std::lock_guard lock(mutex_);
    finished_.push_back(scan_id);
    wakeup_.notify();
  }
  Store& store() { return store_; }

 private:
  void serve();
  bool receive_one(Desk& desk);
  void deliver_posts(Desk& desk);
  bool send(const std::string& peer, wire::Message message);

  IngestOptions options_;
  Store& store_;
  std::function<void(const std::string&)> on_queued_;
  LinkBoard board_;
  std::unique_ptr<zmq::context_t> context_;
  std::unique_ptr<ZapHandler> zap_;
  std::unique_ptr<zmq::socket_t> socket_;
  std::unique_ptr<Door> door_;
  std::string endpoint_;
  std::thread thread_;

  Wakeup wakeup_;
  std::mutex mutex_;  // guards what follows
  bool stopping_ = false;
  std::map<std::string, wire::StageProgress> progress_;  // the latest of every scan, until it is handed over
  std::vector<std::string> finished_;                    // scans whose job ended
};

Result<void> IngestServer::Worker::start() {
  if (thread_.joinable()) return {};
  stopping_ = false;
  try {
    context_ = std::make_unique<zmq::context_t>();
    zap_ = std::make_unique<ZapHandler>(*context_, options_.allow_list, board_.counts);
    socket_ = std::make_unique<zmq::socket_t>(*context_, zmq::socket_type::router);
    configure_host_socket(*socket_, options_.keys);
    door_ = std::make_unique<Door>(*context_, *socket_, board_.counts);
    socket_->bind(options_.endpoint);
    endpoint_ = socket_->get(zmq::sockopt::last_endpoint);
  } catch (const zmq::error_t& error) {
    stop();
    return fail("cannot listen for devices", options_.endpoint + " (" + error.what() + ")",
                "choose another endpoint, or stop what uses this one");
  }
  thread_ = std::thread(&Worker::serve, this);
  return {};
}

void IngestServer::Worker::stop() {
  if (thread_.joinable()) {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
      wakeup_.notify();
    }
    thread_.join();
  }
  door_.reset();
  socket_.reset();
  zap_.reset();
  context_.reset();
}

void IngestServer::Worker::serve() {
  AllowList allowed(options_.allow_list);
  Desk desk(
      {options_.credit_bytes, options_.max_file_bytes, options_.silence_timeout, options_.reserve_bytes}, store_,
      [&](const std::string& key) { return allowed.contains(key); },
      [this](const std::string& peer, wire::Message message) { return send(peer, std::move(message)); }, on_queued_,
      board_, [this] { wakeup_.notify(); });
  while (true) {
    std::array<zmq::pollitem_t, 3> items = {{{socket_->handle(), 0, ZMQ_POLLIN, 0},
                                             {nullptr, wakeup_.descriptor(), ZMQ_POLLIN, 0},
                                             {door_->events().handle(), 0, ZMQ_POLLIN, 0}}};
    zmq::poll(items.data(), items.size(), housekeeping_interval);
    if (items[1].revents != 0) {
      wakeup_.clear();
      const std::lock_guard lock(mutex_);
      if (stopping_) return;
    }
    deliver_posts(desk);
    for (int i = 0; i < messages_between_posts && receive_one(desk); ++i) {
      desk.answer_finished();
    }
    desk.answer_finished();
    desk.forget_gone();
    door_->look();
  }
}

bool IngestServer::Worker::receive_one(Desk& desk) {
  zmq::message_t peer;
  if (!socket_->recv(peer, zmq::recv_flags::dontwait)) return false;
  zmq::message_t body;
  bool more = peer.more();
  if (more) static_cast<void>(socket_->recv(body));
  const bool one_part = more && !body.more();
  while (more && body.more()) static_cast<void>(socket_->recv(body));
  if (more) door_->heard(body.get(ZMQ_SRCFD));
  desk.receive(peer.to_string(), key_of(body), one_part ? body.to_string_view() : std::string_view());
  return true;
}

void IngestServer::Worker::deliver_posts(Desk& desk) {
  std::map<std::string, wire::StageProgress> progress;
  std::vector<std::string> finished;
  {
    const std::lock_guard lock(mutex_);
    progress.swap(progress_);
    finished.swap(finished_);
  }
  for (const auto& [scan, latest] : progress) desk.publish(latest);
  for (const std::string& scan : finished) desk.publish_end(scan);
}

bool IngestServer::Worker::send(const std::string& peer, wire::Message message) {
  try {
    return socket_->send(zmq::buffer(peer), zmq::send_flags::dontwait | zmq::send_flags::sndmore) &&
           socket_->send(message_of(wire::encode(std::move(message))), zmq::send_flags::dontwait);
  } catch (const zmq::error_t&) {
    return false;  // EHOSTUNREACH: the device has left
  }
}

IngestServer::IngestServer(IngestOptions options, Store& store,
                           std::function<void(const std::string& scan_id)> on_queued)
    : worker_(std::make_unique<Worker>(std::move(options), store, std::move(on_queued))) {}

IngestServer::~IngestServer() = default;

Result<void> IngestServer::start() {
  return worker_->start();
}
void IngestServer::stop() {
  worker_->stop();
}
std::string IngestServer::endpoint() const {
  return worker_->endpoint();
}

const LinkBoard& IngestServer::board() const {
  return worker_->board();
}

void IngestServer::publish_progress(const std::string& scan_id, const std::string& stage, double fraction,
                                    const std::string& text) {
  worker_->post(wire::StageProgress{scan_id, stage, fraction, text});
}

Result<void> IngestServer::publish_result(const std::string& scan_id) {
  const Bundle bundle = worker_->store().bundle(scan_id);
  std::vector<StoredFile> results;
  for (const char* name : result_names) {
    const fs::path file = bundle.root() / name;
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    if (error) continue;  // not every reconstruction writes every kind
    Result<std::string> hash = sha256_of_file(file);
    if (!hash) return tl::unexpected(hash.error());
    results.push_back({name, size, std::move(*hash)});
  }
  if (results.empty()) return fail("the reconstruction left no result", bundle.root().string());
  if (Result<void> done = worker_->store().finish_job(scan_id, results); !done) return done;
  worker_->post_finished(scan_id);
  return {};
}

Result<void> IngestServer::publish_failure(const std::string& scan_id, const std::string& reason) {
  if (Result<void> failed = worker_->store().fail_job(scan_id, reason); !failed) return failed;
  worker_->post_finished(scan_id);
  return {};
}

}  // namespace gyre
