// SPDX-License-Identifier: Apache-2.0
#include "common/http/http_server.h"

#include "common/bundle/atomic_file.h"
#include "common/http/event_stream.h"
#include "common/http/own_address.h"
#include "common/metrics/process_usage.h"
#include "tests/device/spool/scan_support.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <sys/socket.h>
#include <unistd.h>
#include <cstring>
#include <nlohmann/json.hpp>

namespace gyre {
namespace {

constexpr const char* secret = "0123456789abcdef0123";
const httplib::Headers marked = {{"X-Gyre", "1"}};

HttpResponse plain(std::string text) {
  HttpResponse response;
  response.body = std::move(text);
  return response;
}

// A server with one route of each kind.
class HttpServerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(write_file(folder_.path() / "file.bin", std::string(200'000, 'x') + "end"));
    HttpOptions options;
    options.token = secret;
    options.max_body_bytes = 1000;
    options.max_upload_bytes = 100'000;
    server_ = std::make_unique<HttpServer>(options);
    server_->serve(files_);
    server_->get("/scans/([a-z]+)/([0-9]+)", [](const HttpRequest& request) {
      const auto word = request.query.find("word");
      return plain(request.parts.at(0) + " " + request.parts.at(1) + " " +
                   (word == request.query.end() ? "" : word->second));
    });
    server_->get("/file", [this](const HttpRequest&) {
      HttpResponse response;
      response.file = folder_.path() / "file.bin";
      return response;
    });
    server_->get("/missing", [this](const HttpRequest&) {
      HttpResponse response;
      response.file = folder_.path() / "missing";
      return response;
    });
    server_->get("/throws", [](const HttpRequest&) -> HttpResponse { throw std::runtime_error("secret detail"); });
    server_->post("/echo", [](const HttpRequest& request) { return plain(request.body); });
    server_->remove("/thing", [](const HttpRequest&) { return plain("removed"); });
    server_->upload("/upload", [](const HttpRequest&, const HttpServer::Reader& read) {
      std::size_t bytes = 0;
      const bool whole = read([&](std::string_view piece) {
        bytes += piece.size();
        return true;
      });
      return whole ? plain(std::to_string(bytes)) : error_response(413, "too much");
    });
    server_->stream("/events", EventStream::type,
                    [this](const HttpRequest&) { return events_.watch([] { return format_event("hello", "1"); }); });
    ASSERT_TRUE(server_->start());
    client_ = std::make_unique<httplib::Client>("127.0.0.1", server_->port());
  }

  // A connection made by hand.
  int connection() const {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(server_->port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    return fd;
  }

  // All that comes back for bytes sent by hand, until the server hangs up.
  std::string answers_to(const std::string& bytes) const {
    const int fd = connection();
    EXPECT_EQ(::send(fd, bytes.data(), bytes.size(), 0), static_cast<ssize_t>(bytes.size()));
    std::string answers;
    std::array<char, 4096> block{};
    for (ssize_t got = 0; (got = ::recv(fd, block.data(), block.size(), 0)) > 0;) {
      answers.append(block.data(), static_cast<std::size_t>(got));
    }
    ::close(fd);
    return answers;
  }

  static constexpr std::array<PageFile, 2> files_ = {PageFile{"/index.html", "text/html; charset=utf-8", "<p>page</p>"},
                                                     PageFile{"/assets/a.js", "text/javascript", "1;"}};
  TemporaryFolder folder_;
  EventStream events_;
  std::unique_ptr<HttpServer> server_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(HttpServerTest, ServesThePageAndItsFiles) {
  const auto page = client_->Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, "<p>page</p>");
  EXPECT_EQ(page->get_header_value("Content-Type"), "text/html; charset=utf-8");
  EXPECT_EQ(page->get_header_value("Cache-Control"), "no-store");
  const auto script = client_->Get("/assets/a.js");
  ASSERT_TRUE(script);
  EXPECT_NE(script->get_header_value("Cache-Control").find("immutable"), std::string::npos);
  EXPECT_EQ(client_->Get("/assets/aXjs")->status, 404);
}

TEST_F(HttpServerTest, GivesHandlersThePartsOfThePathAndTheQuery) {
  EXPECT_EQ(client_->Get("/scans/abc/12?word=a%20b")->body, "abc 12 a b");
  EXPECT_EQ(client_->Get("/scans/abc/12/more")->status, 404);
  EXPECT_EQ(client_->Get("/scans/ABC/12")->status, 404);
}

TEST_F(HttpServerTest, PutsSecurityHeadersOnEveryAnswer) {
  for (const char* path : {"/", "/file", "/missing", "/nowhere", "/throws"}) {
    const auto answer = client_->Get(path);
    ASSERT_TRUE(answer) << path;
    EXPECT_EQ(answer->get_header_value("X-Content-Type-Options"), "nosniff") << path;
    EXPECT_EQ(answer->get_header_value("X-Frame-Options"), "SAMEORIGIN") << path;
    EXPECT_EQ(answer->get_header_value_count("Content-Security-Policy"), 1U) << path;
    EXPECT_EQ(answer->get_header_value("Referrer-Policy"), "no-referrer") << path;
  }
}

TEST_F(HttpServerTest, SendsFilesWholeAndInRanges) {
  const auto whole = client_->Get("/file");
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->body, std::string(200'000, 'x') + "end");
  const auto part = client_->Get("/file", httplib::Headers{{"Range", "bytes=199999-200001"}});
  ASSERT_TRUE(part);
  EXPECT_EQ(part->status, 206);
  EXPECT_EQ(part->body, "xen");
  EXPECT_EQ(client_->Get("/missing")->status, 404);
}

TEST_F(HttpServerTest, TellsNothingOfWhatWentWrongInside) {
  const auto answer = client_->Get("/throws");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 500);
  EXPECT_EQ(answer->body.find("secret"), std::string::npos);
}

TEST_F(HttpServerTest, ChangesSomethingForItsOwnPageOnly) {
  EXPECT_EQ(client_->Post("/echo", "hello", "text/plain")->status, 403);
  EXPECT_EQ(client_->Post("/echo", marked, "hello", "text/plain")->body, "hello");
  EXPECT_EQ(client_->Post("/echo", {{"X-Gyre", "1"}, {"Origin", "http://evil.example"}}, "hello", "text/plain")->status,
            403);
  EXPECT_EQ(client_->Delete("/thing")->status, 403);
  EXPECT_EQ(client_->Delete("/thing", marked)->body, "removed");
  EXPECT_EQ(client_->Get("/", httplib::Headers{{"Host", "evil.example"}})->status, 403);
}

TEST_F(HttpServerTest, TakesNoBodyOfARefusedRequestForTheNextRequest) {
  // What a page of another site can send without being asked: a plain text that looks like a request.
  const std::string inner = "DELETE /thing HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Gyre: 1\r\nContent-Length: 0\r\n\r\n";
  const std::string outer = "POST /echo HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: text/plain\r\nContent-Length: " +
                            std::to_string(inner.size()) + "\r\n\r\n" + inner;
  const std::string answers = answers_to(outer);
  EXPECT_NE(answers.find(" 403 "), std::string::npos);
  EXPECT_EQ(answers.find("removed"), std::string::npos);
}

TEST_F(HttpServerTest, BoundsWhatIsSentToIt) {
  EXPECT_EQ(client_->Post("/echo", marked, std::string(1000, 'a'), "text/plain")->status, 200);
  EXPECT_EQ(client_->Post("/echo", marked, std::string(1001, 'a'), "text/plain")->status, 413);
  EXPECT_EQ(client_->Put("/upload", marked, std::string(100'000, 'a'), "video/mp4")->body, "100000");
  EXPECT_EQ(client_->Put("/upload", marked, std::string(100'001, 'a'), "video/mp4")->status, 413);
}

// Chunks of a body that never ends, to somewhere, from somebody; until the server has had enough.
TEST_F(HttpServerTest, KeepsNothingOfWhatDoesNotEnd) {
  const std::string chunk = "100000\r\n" + std::string(1 << 20, 'x') + "\r\n";
  constexpr int most_chunks = 200;
  const double before = resident_bytes();
  for (const char* head :
       {"POST /echo HTTP/1.1\r\nHost: 127.0.0.1\r\n", "POST /nowhere HTTP/1.1\r\nHost: 127.0.0.1\r\n",
        "PATCH / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Gyre: 1\r\n", "PUT /upload HTTP/1.1\r\nHost: 127.0.0.1\r\n",
        "PUT /upload HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Gyre: 1\r\n",
        "DELETE /thing HTTP/1.1\r\nHost: evil.example\r\nContent-Length: 9\r\n",
        "POST /echo HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Gyre: 1\r\n"}) {
    const int fd = connection();
    const std::string start = std::string(head) + "Content-Type: text/plain\r\nTransfer-Encoding: chunked\r\n\r\n";
    ASSERT_GT(::send(fd, start.data(), start.size(), MSG_NOSIGNAL), 0);
    int sent = 0;
    for (std::size_t at = 0; sent < most_chunks; ++sent, at = 0) {
      ssize_t got = 1;
      for (; at < chunk.size() && got > 0; at += static_cast<std::size_t>(std::max<ssize_t>(got, 0)))
        got = ::send(fd, chunk.data() + at, chunk.size() - at, MSG_NOSIGNAL);
      if (got <= 0) break;
    }
    ::close(fd);
    EXPECT_LT(sent, most_chunks) << head;
  }
  EXPECT_LT(resident_bytes() - before, 50e6);
  EXPECT_EQ(client_->Get("/")->status, 200);
}

// A form that a page of another site can send without being asked.
TEST_F(HttpServerTest, TakesNoPartOfAFormForARequest) {
  const std::string inner = "DELETE /thing HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Gyre: 1\r\nContent-Length: 0\r\n\r\n";
  for (const char* type :
       {"multipart/form-data; boundary=b", "multipart/form-data", "application/x-www-form-urlencoded"}) {
    const std::string outer = std::string("POST /echo HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: ") + type +
                              "\r\nContent-Length: " + std::to_string(inner.size()) + "\r\n\r\n" + inner;
    const std::string answers = answers_to(outer);
    EXPECT_EQ(answers.find("removed"), std::string::npos) << type << answers;
  }
}

TEST_F(HttpServerTest, TurnsTheTokenOfALinkIntoACookie) {
  const auto answer = client_->Get(std::string("/?token=") + secret);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 303);
  EXPECT_EQ(answer->get_header_value("Location"), "/");
  const std::string cookie = answer->get_header_value("Set-Cookie");
  EXPECT_NE(cookie.find("HttpOnly"), std::string::npos);
  EXPECT_NE(cookie.find("SameSite=Lax"), std::string::npos);
  // It stands for the token where the host's name alone does not do.
  const std::string pair = cookie.substr(0, cookie.find(';'));
  EXPECT_EQ(client_->Get("/", httplib::Headers{{"Host", "rig.example"}, {"Cookie", "a=b; " + pair}})->status, 200);
  const httplib::Headers bearer = {{"Host", "rig.example"}, {"Authorization", std::string("Bearer ") + secret}};
  EXPECT_EQ(client_->Get("/", bearer)->status, 200);
  EXPECT_FALSE(client_->Get("/?token=wrong")->has_header("Set-Cookie"));
}

TEST_F(HttpServerTest, TellsAPersonWithoutTheTokenOnAPage) {
  HttpOptions options;
  options.address = "0.0.0.0";
  options.token = secret;
  options.link_source = "as the rig shows it";
  HttpServer server(options);
  server.serve(files_);
  ASSERT_TRUE(server.start());
  EXPECT_EQ(server.url(), "http://" + own_address() + ":" + std::to_string(server.port()) + "/?token=" + secret);
  httplib::Client elsewhere(own_address(), server.port());
  const auto page = elsewhere.Get("/");
  if (!page || page->status == 403) GTEST_SKIP() << "this machine has no address but its loopback";
  EXPECT_EQ(page->status, 401);
  EXPECT_EQ(page->get_header_value("Content-Type"), "text/html; charset=utf-8");
  EXPECT_NE(page->body.find("as the rig shows it"), std::string::npos);
  EXPECT_NE(elsewhere.Get("/?token=wrong")->body.find("not valid"), std::string::npos);
  const auto script = elsewhere.Get("/assets/a.js");
  EXPECT_EQ(script->status, 401);
  EXPECT_TRUE(nlohmann::json::parse(script->body).contains("error"));
  EXPECT_EQ(elsewhere.Get(std::string("/?token=") + secret)->status, 303);
}

TEST_F(HttpServerTest, StreamsEventsUntilItStops) {
  std::string heard;
  const auto listen = [&] {
    client_->Get("/events", [&](const char* data, std::size_t length) {
      heard.append(data, length);
      if (heard.find("hello") != std::string::npos && heard.find("tick") == std::string::npos) {
        events_.publish("tick", "1");
      }
      return heard.find("tick") == std::string::npos;
    });
  };
  listen();
  EXPECT_NE(heard.find("event: hello\ndata: 1\n\n"), std::string::npos);
  EXPECT_NE(heard.find("event: tick\ndata: 1\n\n"), std::string::npos);
  std::thread watcher([&] { client_->Get("/events", [](const char*, std::size_t) { return true; }); });
  server_->stop();
  watcher.join();
}

// One that never ends its request, and one that never ends its upload; no keep-alive runs out for them.
TEST_F(HttpServerTest, StopsWhatsoeverItsPeersHaveBegun) {
  std::vector<int> peers;
  for (const char* begun :
       {"GET / HTT", "PUT /upload HTTP/1.1\r\nHost: localhost\r\nX-Gyre: 1\r\nContent-Length: 9\r\n\r\nhalf"}) {
    peers.push_back(connection());
    ASSERT_GT(::send(peers.back(), begun, std::strlen(begun), 0), 0);
  }
  server_->stop();
  for (const int peer : peers) {
    std::array<char, 4096> block{};
    while (::recv(peer, block.data(), block.size(), 0) > 0) {
    }
    ::close(peer);
  }
}

TEST_F(HttpServerTest, SaysWhenItsPortIsTaken) {
  HttpOptions options;
  options.port = server_->port();
  HttpServer second(options);
  const Result<void> started = second.start();
  ASSERT_FALSE(started);
  EXPECT_NE(started.error().message().find(std::to_string(server_->port())), std::string::npos);
}

TEST(HttpOptions, AreChecked) {
  HttpOptions options;
  EXPECT_TRUE(options.check());
  options.port = 70000;
  EXPECT_FALSE(options.check());
  options.port = 0;
  options.token = "short";
  EXPECT_FALSE(options.check());
}

}  // namespace
}  // namespace gyre
