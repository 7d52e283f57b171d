// SPDX-License-Identifier: Apache-2.0
#include "device/page/device_page.h"

#include "device/page/page_files.h"
#include "device/page/scan_rows.h"
#include "device/page/status_view.h"

#include <charconv>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <optional>

namespace gyre {

namespace {

using nlohmann::json;
using Kind = OperatorCommand::Kind;

constexpr std::chrono::milliseconds status_interval{100};
constexpr int looks_between_scans = 10;  // the list of scans changes slowly, and takes longer to make
constexpr std::chrono::milliseconds longest_poll{
    1000};  // stop() waits for polls, and a browser that has gone holds one
const std::string scan_pattern = "([0-9A-HJKMNP-TV-Z]{26})";

// What the page may ask for; the rig is shut down at its button only.
std::optional<Kind> kind_of(const std::string& command) {
  static const std::map<std::string, Kind> kinds = {
      {"start", Kind::start}, {"stop", Kind::stop}, {"cancel", Kind::cancel}, {"acknowledge", Kind::acknowledge}};
  const auto found = kinds.find(command);
  return found == kinds.end() ? std::nullopt : std::optional(found->second);
}

std::string type_of(const std::string& name) {
  if (name.ends_with(".glb") || name.ends_with(".vrm")) return "model/gltf-binary";
  if (name.ends_with(".json")) return "application/json";
  if (name.ends_with(".html")) return "text/html; charset=utf-8";
  return "application/octet-stream";
}

// A report brings its own script and styles, and may reach nothing outside itself.
constexpr const char* report_policy =
    "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'; frame-ancestors 'self'; "
    "sandbox allow-scripts";

// A keyframe at an eighth of its size, for the list.
HttpResponse small_picture(const std::filesystem::path& file) {
  const cv::Mat image = cv::imread(file.string(), cv::IMREAD_REDUCED_COLOR_8);
  std::vector<unsigned char> bytes;
  if (image.empty() || !cv::imencode(".jpg", image, bytes, {cv::IMWRITE_JPEG_QUALITY, 80})) {
    return error_response(404, "there is no such picture");
  }
  HttpResponse response;
  response.type = "image/jpeg";
  response.body.assign(bytes.begin(), bytes.end());
  response.headers["Cache-Control"] = "private, max-age=86400";
  return response;
}

std::uint64_t number_in(const HttpRequest& request, const std::string& name) {
  const auto found = request.query.find(name);
  std::uint64_t number = 0;
  if (found != request.query.end()) {
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), number);
  }
  return number;
}

}  // namespace

DevicePage::DevicePage(HttpOptions http, const Spool& spool, OnCommand on_command)
    : spool_(spool), on_command_(std::move(on_command)), server_(std::move(http)) {
  server_.serve(device_page_files());
  add_live_routes();
  add_scan_routes();
}

DevicePage::~DevicePage() {
  stop();
}

Result<void> DevicePage::start() {
  if (const Result<void> started = server_.start(); !started) return started;
  watcher_ = std::thread([this] { watch(); });
  return {};
}

void DevicePage::stop() {
  {
    const std::scoped_lock lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  if (watcher_.joinable()) watcher_.join();
  picture_.close();
  server_.stop();
}

void DevicePage::show(const LiveStatus& status) {
  const std::scoped_lock lock(mutex_);
  status_ = status;
}

LiveStatus DevicePage::status() const {
  const std::scoped_lock lock(mutex_);
  return status_;
}

// The status changes with every frame and the spool from many sides: looked at now and then, a page gets what is so
// and no history.
void DevicePage::watch() {
  json told;
  json told_scans;
  std::unique_lock lock(mutex_);
  for (int look = 0; !wake_.wait_for(lock, status_interval, [this] { return stopping_; }); ++look) {
    const LiveStatus now = status_;
    lock.unlock();
    if (events_.is_watched()) {
      if (json view = status_view(now); view != told) {
        events_.publish("status", view.dump());
        told = std::move(view);
      }
      if (look % looks_between_scans == 0) {
        if (json rows = scan_rows(spool_, now); rows != told_scans) {
          events_.publish("scans", rows.dump());
          told_scans = std::move(rows);
        }
      }
    }
    lock.lock();
  }
}

void DevicePage::add_live_routes() {
  server_.get("/api/status", [this](const HttpRequest&) { return json_response(status_view(status())); });
  server_.get("/api/scans", [this](const HttpRequest&) { return json_response(scan_rows(spool_, status())); });
  server_.stream("/api/events", EventStream::type, [this](const HttpRequest&) {
    return events_.watch([this] {
      const LiveStatus now = status();
      return format_event("status", status_view(now).dump()) + format_event("scans", scan_rows(spool_, now).dump());
    });
  });
  // One picture an answer, asked for when the one before is shown: nothing is ever on its way that is not the latest.
  server_.get("/api/preview\\.jpg", [this](const HttpRequest& request) {
    HttpResponse response;
    const std::optional<LatestPicture::Sent> picture = picture_.wait(number_in(request, "after"), longest_poll);
    if (!picture) {
      response.status = 204;
      return response;
    }
    response.type = "image/jpeg";
    response.body = picture->jpeg;
    response.headers["X-Gyre-Number"] = std::to_string(picture->number);
    return response;
  });
  server_.post("/api/commands", [this](const HttpRequest& request) { return command(request); });
}

HttpResponse DevicePage::command(const HttpRequest& request) const {
  const json body = json::parse(request.body, nullptr, false);
  if (!body.is_object()) return error_response(400, "the request is not a JSON object");
  const json name = body.value("command", json());
  const std::optional<Kind> kind = name.is_string() ? kind_of(name.get<std::string>()) : std::nullopt;
  if (!kind) return error_response(400, "there is no such command");
  OperatorCommand command;
  command.kind = *kind;
  if (const json height = body.value("height_mm", json()); !height.is_null()) {
    if (!height.is_number()) return error_response(400, "a stature is a number of millimetres");
    command.height_mm = height.get<double>();
    if (!(*command.height_mm >= 300.0 && *command.height_mm <= 2600.0)) {
      return error_response(400, "a stature is 300 to 2600 mm");
    }
  }
  if (const Result<void> done = on_command_(command); !done) return error_response(409, done.error().message());
  return json_response(json::object());
}

void DevicePage::add_scan_routes() {
  const std::string scan = "/scans/" + scan_pattern;
  // Only names the spool knows, so that no path leads anywhere else.
  server_.get(scan + "/(avatar\\.(?:glb|vrm|fbx)|report\\.(?:html|json))", [this](const HttpRequest& request) {
    const std::string& id = request.parts[0];
    const std::string& name = request.parts[1];
    const std::optional<SpooledScan> found = spool_.scan(id);
    if (!found || find_file(found->results, name) == nullptr) return error_response(404, "there is no such result");
    HttpResponse response;
    response.type = type_of(name);
    response.file = spool_.bundle(id).root() / name;
    if (name == "report.html") response.headers["Content-Security-Policy"] = report_policy;
    if (request.query.contains("download")) {
      response.headers["Content-Disposition"] = "attachment; filename=\"" + id + "-" + name + "\"";
    }
    return response;
  });
  server_.get(scan + "/frames/([a-z]{1,16}-[0-9]{6}\\.jpg)", [this](const HttpRequest& request) {
    const std::optional<SpooledScan> found = spool_.scan(request.parts[0]);
    if (!found || find_file(found->files, "frames/" + request.parts[1]) == nullptr) {
      return error_response(404, "there is no such picture");
    }
    return small_picture(spool_.bundle(request.parts[0]).frames() / request.parts[1]);
  });
}

}  // namespace gyre
