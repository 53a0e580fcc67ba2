//! Processes RustDDS's events about other participants and their endpoints (see `matches`).

use super::first_sample_request::FirstSampleRequest;
use super::incompatible_qos::Mismatch;
use super::matches::{Matches, OwnEndpoint, Pair, State};
use super::peer_recovery::{Lost, Peer, Prefix, prefix};
use dq_common::text::cut;
use futures::StreamExt;
use rustdds::dds::statusevents::{DomainParticipantStatusEvent as Event, LostReason};
use rustdds::{DomainParticipantStatusListener, StatusEvented};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::time::Instant;

impl Matches {
    /// Processes the participant's events forever, and requests the first sample of each matched writer. Call this once per
    /// participant, because events go to one reader only.
    pub async fn follow(
        self,
        listener: DomainParticipantStatusListener,
        request: Option<Arc<FirstSampleRequest>>,
        mut lost: Lost,
    ) {
        let mut events = listener.as_async_status_stream();
        loop {
            let event = tokio::select! {
                Some(event) = events.next() => event,
                peer = lost.heard() => {
                    lost.is_back(peer);
                    continue;
                }
                else => return,
            };
            self.note_loss(&event, &mut lost);
            if let (Event::RemoteWriterMatched { local_reader, remote_writer }, Some(request)) =
                (&event, &request)
            {
                let (request, reader, writer) = (request.clone(), *local_reader, *remote_writer);
                tokio::spawn(async move { request.send(reader, writer).await });
            }
            self.take(event);
            self.changed.notify_waiters();
        }
    }

    /// Notes which participants were lost, and which of the lost participants are back.
    fn note_loss(&self, event: &Event, lost: &mut Lost) {
        match event {
            Event::ParticipantLost { id, reason: LostReason::Timeout { .. } } => {
                let peer = self.peer(prefix(id));
                peer.into_iter().for_each(|peer| lost.add(prefix(id), peer));
            }
            Event::ParticipantDiscovered { dpd } => {
                let peer = lost.remove(prefix(dpd.guid.prefix));
                peer.into_iter().for_each(|peer| lost.is_back(peer));
            }
            _ => {}
        }
    }

    /// Returns a description of `participant`; `None` if the participant was not connected with our nodes.
    fn peer(&self, participant: Prefix) -> Option<Peer> {
        let state = self.lock();
        let (mut known, mut heard_on) = (None, BTreeSet::new());
        for Pair { ours, remote } in
            state.pairs.iter().filter(|pair| prefix(pair.remote.prefix) == participant)
        {
            // Endpoints without a registered owner are skipped.
            let Some(OwnEndpoint { topic, warn }) = state.own.get(ours) else { continue };
            if state.writers.contains_key(remote) {
                heard_on.insert(topic.clone());
            }
            known = Some((*remote, warn.clone()));
        }
        let (remote, warn) = known?;
        let name = self.owners.describe(remote);
        Some(Peer { name, heard_on: heard_on.into_iter().collect(), warn })
    }

    fn take(&self, event: Event) {
        let mut state = self.lock();
        match event {
            Event::RemoteReaderMatched { local_writer: ours, remote_reader: remote }
            | Event::RemoteWriterMatched { local_reader: ours, remote_writer: remote } => {
                state.pairs.insert(Pair { ours, remote });
            }
            Event::WriterDetected { writer } => {
                state.first_found.find(writer.guid);
                state.writers.insert(writer.guid, cut(&writer.topic_name).into_owned());
            }
            Event::ReaderDetected { reader } => {
                state.readers.insert(reader.guid, cut(&reader.topic_name).into_owned());
                state.found = Some(Instant::now());
            }
            Event::ParticipantDiscovered { .. } => state.found = Some(Instant::now()),
            Event::ReaderLost { guid, .. } | Event::WriterLost { guid, .. } => {
                state.forget(|remote| remote == guid);
            }
            Event::ParticipantLost { id, .. } => state.forget(|remote| remote.prefix == id),
            Event::RemoteReaderQosIncompatible {
                local_writer,
                remote_reader,
                requested_qos,
                offered_qos,
            } => {
                let mismatch = Mismatch::new(&requested_qos, &offered_qos);
                let pair = Pair { ours: local_writer, remote: remote_reader };
                self.warn(&mut state, pair, move |topic, peer| mismatch.warning_of_publisher(topic, peer));
            }
            Event::RemoteWriterQosIncompatible {
                local_reader,
                remote_writer,
                requested_qos,
                offered_qos,
            } => {
                let mismatch = Mismatch::new(&requested_qos, &offered_qos);
                if mismatch.is_reliability()
                    && let Some(publisher) = state.adapting.get_mut(&local_reader)
                {
                    publisher.get_or_insert(remote_writer);
                    return;
                }
                let pair = Pair { ours: local_reader, remote: remote_writer };
                self.warn(&mut state, pair, move |topic, peer| mismatch.warning_of_subscriber(topic, peer));
            }
            _ => {}
        }
    }

    /// Warns once about a pair of endpoints that do not match. First waits up to a second for the peer's name.
    fn warn(&self, state: &mut State, pair: Pair, text: impl FnOnce(&str, &str) -> String + Send + 'static) {
        let Some(OwnEndpoint { topic, warn }) = state.own.get(&pair.ours).cloned() else { return };
        if state.incompatible.contains_key(&pair) {
            return;
        }
        state.incompatible.insert(pair, None);
        let matches = self.clone();
        tokio::spawn(async move {
            let warning = text(&topic, &matches.introduced(pair.remote).await);
            warn(&warning);
            if let Some(kept) = matches.lock().incompatible.get_mut(&pair) {
                *kept = Some(warning);
            }
        });
    }
}
