"""A client of the node's parameter services."""

import itertools
import time

import messages
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic


class Asker:
    """Asks the node's services, and hears `/parameter_events`.

    header: asks as rmw_cyclonedds does; else as the others do, but for the identity in the inline QoS, which Cyclone DDS does not write
    """

    def __init__(self, participant, node="gyroid", header=True):
        self.header, self.number, self.guid = header, itertools.count(1), 0x0123456789ABCDEF
        self.wires = {}
        for name, described in messages.SERVICES.items():
            asked, answered = messages.service(*described, header)
            out = Topic(participant, f"rq/{node}/{name}Request", asked)
            back = Topic(participant, f"rr/{node}/{name}Reply", answered)
            qos = messages.reliable_qos()
            self.wires[name] = (asked, DataWriter(participant, out, qos=qos), DataReader(participant, back, qos=qos))
        topic = Topic(participant, "rt/parameter_events", messages.ParameterEvent)
        self.heard = DataReader(participant, topic, qos=messages.reliable_qos())
        end = time.monotonic() + 20
        while not all(w.get_matched_subscriptions() and r.get_matched_publications() for _, w, r in self.wires.values()):
            if time.monotonic() > end:
                raise TimeoutError("the services are not there")
            time.sleep(0.01)

    def ask(self, service, **fields):
        """The answer to one request."""
        kind, writer, reader = self.wires[service]
        identity = {"guid": self.guid, "number": next(self.number)} if self.header else {}
        writer.write(kind(**identity, **fields))
        end = time.monotonic() + 10
        while time.monotonic() < end:
            for answer in reader.take(10):
                # what is no sample says that a writer is gone
                if isinstance(answer, reader.topic.data_type) and all(getattr(answer, k) == v for k, v in identity.items()):
                    return answer
            time.sleep(0.005)
        raise TimeoutError(f"no answer to {service}")

    def events(self):
        """What was said to have changed."""
        return [e for e in self.heard.take(100) if hasattr(e, "node")]
