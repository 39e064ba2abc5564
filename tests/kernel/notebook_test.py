"""The kernel of notebooks: real notebooks run by nbclient. Without xeus or nbclient the test says so and passes."""
import asyncio
import base64
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = os.path.abspath(os.environ.get("PENDULA", "build/release/pendula"))
KERNEL = os.path.join(os.path.dirname(PROGRAM), "pendula-kernel")

try:
    import nbformat
    from jupyter_client.manager import start_new_kernel
    from nbclient import NotebookClient
except ImportError:
    nbformat = None


def install():
    prefix = tempfile.mkdtemp()
    subprocess.run([PROGRAM, "kernel", "install", "--prefix", prefix], check=True, stdout=subprocess.DEVNULL)
    os.environ["JUPYTER_PATH"] = os.path.join(prefix, "share", "jupyter")
    os.environ["IPYTHONDIR"] = os.environ["JUPYTER_RUNTIME_DIR"] = prefix
    return prefix


class NotebookTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.prefix = install()
        cls.manager, cls.client = start_new_kernel(kernel_name="pendula")

    @classmethod
    def tearDownClass(cls):
        cls.client.stop_channels()
        cls.manager.shutdown_kernel(now=True)

    def run_cell(self, code, interrupt_after=None):
        """The reply and the messages of a cell."""
        identity = self.client.execute(code, allow_stdin=False)
        if interrupt_after:
            time.sleep(interrupt_after)
            self.manager.interrupt_kernel()
        messages = []
        while True:
            message = self.client.get_iopub_msg(timeout=30)
            if message["parent_header"].get("msg_id") != identity:
                continue
            if message["msg_type"] == "status" and message["content"]["execution_state"] == "idle":
                break
            messages.append(message)
        while True:
            reply = self.client.get_shell_msg(timeout=30)
            if reply["parent_header"].get("msg_id") == identity:
                return reply["content"], messages

    def outputs(self, code):
        reply, messages = self.run_cell(code)
        self.assertEqual(reply["status"], "ok", reply)
        return messages

    def text_of(self, messages):
        return "".join(m["content"]["text"] for m in messages if m["msg_type"] == "stream")

    def result_of(self, messages):
        found = [m["content"]["data"] for m in messages if m["msg_type"] == "execute_result"]
        self.assertEqual(len(found), 1, messages)
        return found[0]

    def test_text_and_values(self):
        self.assertEqual(self.text_of(self.outputs('print("a", 1) io.write "b\\n"')), "a 1\nb\n")
        data = self.result_of(self.outputs('x = var "x"\nlocal kept = 3\nx^2/3'))
        self.assertEqual(data["text/plain"], "x²/3")
        self.assertIn("\\frac{x^2}{3}", data["text/latex"])
        self.assertEqual(self.result_of(self.outputs("kept + 1"))["text/plain"], "4")
        self.assertEqual(self.result_of(self.outputs("ans"))["text/plain"], "4")
        quiet = [m["msg_type"] for m in self.outputs("y = 1")]
        self.assertEqual([kind for kind in quiet if kind not in ("status", "execute_input")], [])
        self.assertIn("text/html", self.result_of(self.outputs("dae { der(x) ~ -x }")))

    def test_figures(self):
        data = self.result_of(self.outputs('plot({1, 4, 9}, { title = "Squares" })'))
        self.assertIn("<svg", data["image/svg+xml"])
        image = re.search(r"base64,([^\"]*)", data["text/html"])
        self.assertIn(b"Squares", base64.b64decode(image[1]))
        shown = [m for m in self.outputs("for i = 1, 2 do plot({1, i}):show() end") if m["msg_type"] == "display_data"]
        self.assertEqual(len(shown), 2)
        shown = [m for m in self.outputs('view(var "x"^2)') if m["msg_type"] == "display_data"]
        self.assertEqual(len(shown), 1)

    def test_figures_after_many_cells(self):
        """What stands between a figure and its picture does not grow with the number of cells."""
        for _ in range(230):
            self.outputs("y = 1")
        shown = [m for m in self.outputs("plot({1, 2}):show()") if m["msg_type"] == "display_data"]
        self.assertEqual(len(shown), 1)
        shown = [m for m in self.outputs("tf({1}, {1, 1}):bode()") if m["msg_type"] == "display_data"]
        self.assertEqual(len(shown), 1)

    def test_question_mark(self):
        self.assertIn("lagrange{", self.text_of(self.outputs("lagrange?")))
        self.assertIn("reduce", self.text_of(self.outputs("?model:reduce")))

    def test_errors(self):
        reply, messages = self.run_cell("y = 1\nnothing()")
        self.assertEqual(reply["status"], "error")
        self.assertRegex(reply["evalue"], r"^In\[\d+\]:2: undefined variable 'nothing'")
        self.assertEqual([m["msg_type"] for m in messages if m["msg_type"] == "error"], ["error"])
        self.assertEqual(self.run_cell("x = = 1")[0]["status"], "error")
        self.assertIn("keyboard", self.run_cell("io.read()")[0]["evalue"])
        self.assertIn("kernel", self.run_cell("os.exit()")[0]["evalue"])
        self.assertEqual(self.result_of(self.outputs("1 + 1"))["text/plain"], "2")

    def test_interrupt(self):
        begin = time.time()
        reply, _ = self.run_cell("while true do end", interrupt_after=0.5)
        self.assertEqual(reply["status"], "error")
        self.assertEqual(reply["ename"], "Interrupted")
        self.assertLess(time.time() - begin, 10)
        self.manager.interrupt_kernel()                # while nothing runs: nothing happens
        time.sleep(0.3)
        self.assertTrue(self.manager.is_alive())
        self.assertEqual(self.result_of(self.outputs("2 + 2"))["text/plain"], "4")

    def test_progress_comes_while_it_runs(self):
        identity = self.client.execute("for i = 1, 4 do print(i) os.execute 'sleep 0.4' end")
        times = []
        while True:
            message = self.client.get_iopub_msg(timeout=30)
            if message["parent_header"].get("msg_id") != identity:
                continue
            if message["msg_type"] == "stream":
                times.append(time.time())
            if message["msg_type"] == "status" and message["content"]["execution_state"] == "idle":
                break
        self.assertGreater(times[-1] - times[0], 0.3)

    def ask(self, method, *arguments):
        identity = method(*arguments)
        while True:
            reply = self.client.get_shell_msg(timeout=30)
            if reply["parent_header"].get("msg_id") == identity:
                return reply["content"]

    def test_completion_and_inspection(self):
        self.outputs('sys = dae { der(var "x") ~ -var "x" }')
        code = 'print "äöü" sys:red'
        reply = self.ask(self.client.complete, code, len(code))
        self.assertEqual(reply["matches"], ["reduce"])
        self.assertEqual((reply["cursor_start"], reply["cursor_end"]), (len(code) - 3, len(code)))
        reply = self.ask(self.client.inspect, "lagrange{", 4)
        self.assertTrue(reply["found"])
        self.assertIn("lagrange{", reply["data"]["text/plain"])
        self.assertIn("reduce", self.ask(self.client.inspect, "sys:reduce()", 8)["data"]["text/plain"])
        self.assertFalse(self.ask(self.client.inspect, "nosuchname", 4)["found"])
        for code, status in (("x = 1", "complete"), ("for i = 1, 2 do", "incomplete"), ("x = = 2", "invalid")):
            self.assertEqual(self.ask(self.client.is_complete, code)["status"], status, code)

    def test_a_whole_notebook(self):
        cells = ['q = var("q", 2)\npend = lagrange { q = q, T = q.dot.T*q.dot/2, V = 9.81*q[2], '
                 'C = { (q.T*q - 1)/2 } }\npend', "at = pend:init { fix = { [q[1]] = 1, [q[2].dot] = 0 }, "
                 "guess = { [q[2]] = 0 } }\nat:ledger()", "sol = pend:reduce():integrate { start = at, to = 2 }\n"
                 "plot(sol, { q[1], q[2] })", "sol:drift()"]
        notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in cells])
        NotebookClient(notebook, kernel_name="pendula", timeout=60).execute()
        self.assertIn("<math", notebook.cells[0].outputs[0].data["text/html"])
        self.assertIn("image/svg+xml", notebook.cells[2].outputs[0].data)
        target = os.path.join(self.prefix, "notebook.ipynb")
        nbformat.write(notebook, target)
        try:
            import nbconvert
        except ImportError:
            return
        page, _ = nbconvert.HTMLExporter(template_name="basic").from_filename(target)
        self.assertIn("data:image/svg+xml;base64", page)
        self.assertIn("<math", page)


if __name__ == "__main__":
    if not os.path.exists(KERNEL):
        print("no pendula-kernel beside the program: apt-get install xeus-dev, and build it")
    elif nbformat is None:
        print("no nbclient here: apt-get install python3-nbclient")
    else:
        asyncio.set_event_loop(asyncio.new_event_loop())
        unittest.main(argv=sys.argv, warnings="ignore")
