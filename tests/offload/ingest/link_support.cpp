// SPDX-License-Identifier: Apache-2.0
#include "tests/offload/ingest/link_support.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

// libzmq is not built with ThreadSanitizer, which therefore does not see how its threads hand messages over.
extern "C" const char* __tsan_default_options();  // NOLINT
extern "C" const char* __tsan_default_options() {
  return "ignore_noninstrumented_modules=1";
}  // NOLINT

namespace gyre {

TestHost::TestHost() {
  options_.endpoint = "tcp://127.0.0.1:*";
  options_.keys = make_key_pair();
  options_.allow_list = folder_.path() / "devices";
}

void TestHost::start() {
  Result<std::unique_ptr<Store>> store = Store::open(folder_.path() / "store");
  ASSERT_TRUE(store) << store.error().message();
  store_ = std::move(*store);
  ASSERT_TRUE(options_.check());
  server_ = std::make_unique<IngestServer>(options_, *store_, [this](const std::string& scan) {
    const std::lock_guard lock(mutex_);
    queued_.push_back(scan);
  });
  // The port of the one before may take a moment to become free.
  Result<void> started;
  ASSERT_TRUE(eventually([&] { return (started = server_->start()).has_value(); })) << started.error().message();
  options_.endpoint = server_->endpoint();
}

void TestHost::stop() {
  server_.reset();
  store_.reset();
}

void TestHost::authorise(const KeyPair& device) {
  ASSERT_TRUE(authorise_device(options_.allow_list, sha256(device.public_key).substr(0, 12), device.public_key));
}

std::vector<std::string> TestHost::queued() const {
  const std::lock_guard lock(mutex_);
  return queued_;
}

void TestHost::run_jobs() {
  while (const std::optional<StoredJob> job = store_->take_job().value()) {
    const Bundle bundle = store_->bundle(job->scan);
    ASSERT_TRUE(write_file(bundle.root() / "avatar.glb", avatar_of(bundle)));
    ASSERT_TRUE(write_file(bundle.root() / "report.json", std::string_view("{}")));
    ASSERT_TRUE(server_->publish_result(job->scan));
  }
}

TestDevice::TestDevice(std::string name) {
  options_.keys = make_key_pair();
  options_.device_name = std::move(name);
  options_.reconnect_min = std::chrono::milliseconds(5);
  options_.reconnect_max = std::chrono::milliseconds(50);
}

void TestDevice::open_spool() {
  Result<std::unique_ptr<Spool>> spool = Spool::open(folder_.path());
  ASSERT_TRUE(spool) << spool.error().message();
  spool_ = std::move(*spool);
}

void TestDevice::connect(const TestHost& host, const std::string& endpoint) {
  if (!spool_) open_spool();
  options_.host = endpoint;
  if (options_.host_public_key.empty()) options_.host_public_key = host.options().keys.public_key;
  ASSERT_TRUE(options_.check());
  uplink_ = std::make_unique<Uplink>(options_, *spool_);
}

void TestDevice::stop() {
  uplink_.reset();
  spool_.reset();
}

std::string avatar_of(const Bundle& bundle) {
  std::string content = read_file(bundle.scan_file()).value() + read_file(bundle.frame_log()).value();
  content += sha256_of_folder(bundle.frames()).value();
  std::string avatar;
  for (int i = 0; avatar.size() < 700'000; ++i) avatar += sha256(content + std::to_string(i));
  return avatar;
}

std::uint64_t bytes_below(const std::filesystem::path& folder) {
  std::uint64_t total = 0;
  std::error_code error;
  for (auto it = std::filesystem::recursive_directory_iterator(folder, error);
       !error && it != std::filesystem::recursive_directory_iterator(); it.increment(error)) {
    std::error_code gone;
    const std::uintmax_t size = it->file_size(gone);
    if (!gone) total += size;
  }
  return total;
}

struct LogCapture::Sink : spdlog::sinks::base_sink<std::mutex> {
  void sink_it_(const spdlog::details::log_msg& message) override {
    text.append(message.payload.data(), message.payload.size());
    text += '\n';
  }
  void flush_() override {}
  bool has(const std::string& what) {
    const std::lock_guard lock(mutex_);
    return text.find(what) != std::string::npos;
  }
  std::string text;
};

LogCapture::LogCapture() : sink_(std::make_shared<Sink>()) {
  spdlog::default_logger()->sinks().push_back(sink_);
}
LogCapture::~LogCapture() {
  spdlog::default_logger()->sinks().pop_back();
}
bool LogCapture::has(const std::string& text) const {
  return sink_->has(text);
}

}  // namespace gyre
