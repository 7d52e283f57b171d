// SPDX-License-Identifier: Apache-2.0
// The page of the rig: what the camera sees, the one thing to do, what is covered, the button, and past scans with
// their avatars.
#pragma once

#include "common/http/event_stream.h"
#include "common/http/http_server.h"
#include "device/page/latest_picture.h"
#include "device/session/live_status.h"
#include "device/session/operator_command.h"
#include "device/spool/spool.h"

#include <condition_variable>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

namespace gyre {

inline constexpr int device_page_port = 7470;  // when nothing else is said

// Serves between start() and stop(). show() and preview() may be called from any thread, with every frame: they keep
// what they get and never wait for a browser.
class DevicePage {
 public:
  // The operator asks for something. Called on the server's threads, several at once; an error is shown to whoever
  // asked. Must return soon.
  using OnCommand = std::function<Result<void>(const OperatorCommand&)>;

  // The spool outlives the page.
  DevicePage(HttpOptions http, const Spool& spool, OnCommand on_command);
  ~DevicePage();  // stops
  DevicePage(const DevicePage&) = delete;
  DevicePage& operator=(const DevicePage&) = delete;

  // For routes that are not the page's own; before start().
  HttpServer& server() { return server_; }

  Result<void> start();
  void stop();
  int port() const { return server_.port(); }
  std::string address() const { return server_.address(); }
  std::string url() const { return server_.url(); }

  void show(const LiveStatus& status);

  // What the camera sees: 8-bit BGR, upright, that nobody writes to any more. Compressed only when somebody looks.
  void preview(const cv::Mat& image) { picture_.set(image); }

 private:
  void add_live_routes();
  void add_scan_routes();
  HttpResponse command(const HttpRequest& request) const;
  LiveStatus status() const;
  void watch();

  const Spool& spool_;
  OnCommand on_command_;
  LatestPicture picture_;
  EventStream events_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  LiveStatus status_;
  bool stopping_ = false;
  std::thread watcher_;
  HttpServer server_;  // goes first
};

}  // namespace gyre
