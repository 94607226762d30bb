"use strict";

// What is served is shown as text and never as markup.

const EVERY_MS = 2000;
const LONGEST_NAME = 100;
let unreached = false;
const say = (text) => { document.getElementById("said").textContent = text; };

function cell(row, text) {
  const made = row.insertCell();
  made.textContent = text;
  return made;
}

function decision(job) {
  if (job.go !== null) return job.go ? "GO" : "NO-GO";
  if (job.good !== null) return job.good ? "good" : "BAD";
  return "";
}

function show(jobs) {
  const rows = document.getElementById("rows");
  rows.replaceChildren();
  for (const job of jobs) {
    const row = rows.insertRow();
    cell(row, job.name);
    cell(row, job.received_at.slice(0, 19).replace("T", " "));
    cell(row, job.error ? `${job.state}: ${job.error}` : job.state).className = "error";
    cell(row, decision(job));
    cell(row, job.verdict || "");
    const last = cell(row, "");
    for (const name of job.documents) {
      const link = document.createElement("a");
      link.href = `api/sessions/${job.id}/${name}`;
      link.target = "_blank";
      link.textContent = name;
      last.append(link);
    }
  }
}

// What an answer other than the wanted one says: a sentence, or JSON with one.
async function refusal(answer) {
  const text = await answer.text();
  try {
    return JSON.parse(text).error;
  } catch {
    return text;
  }
}

async function look() {
  try {
    const answer = await fetch("api/sessions");
    if (answer.ok) show(await answer.json());
    if (unreached || !answer.ok) say(answer.ok ? "" : await refusal(answer));
    unreached = !answer.ok;
  } catch (error) {
    unreached = true;
    say(`not reached: ${error.message}`);
  }
}

document.getElementById("send").addEventListener("submit", async (event) => {
  event.preventDefault();
  const [file] = document.getElementById("file").files;
  const plain = file.name.replace(/[^A-Za-z0-9_.-]/g, "_");
  const name = plain.slice(-LONGEST_NAME).replace(/^[^A-Za-z0-9]+/, "");  // with its ending
  say("sending …");
  try {
    const answer = await fetch(`api/sessions?filename=${encodeURIComponent(name || "recording")}`, {
      method: "POST", body: file, headers: { "content-type": "application/octet-stream" },
    });
    say(answer.ok ? "sent" : await refusal(answer));
  } catch (error) {
    say(`not sent: ${error.message}`);
  }
  look();
});

document.getElementById("go").disabled = false;
look();
setInterval(look, EVERY_MS);
