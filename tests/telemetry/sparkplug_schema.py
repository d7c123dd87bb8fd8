"""Sparkplug B's published schema for Google's protobuf, as far as it is used: what the gateway's own encoder is read with."""

from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

F = descriptor_pb2.FieldDescriptorProto
METRIC = {
    "name": (1, F.TYPE_STRING),
    "alias": (2, F.TYPE_UINT64),
    "timestamp": (3, F.TYPE_UINT64),
    "datatype": (4, F.TYPE_UINT32),
    "is_historical": (5, F.TYPE_BOOL),
    "is_transient": (6, F.TYPE_BOOL),
    "is_null": (7, F.TYPE_BOOL),
    "int_value": (10, F.TYPE_UINT32),
    "long_value": (11, F.TYPE_UINT64),
    "float_value": (12, F.TYPE_FLOAT),
    "double_value": (13, F.TYPE_DOUBLE),
    "boolean_value": (14, F.TYPE_BOOL),
    "string_value": (15, F.TYPE_STRING),
}


def _payload_class() -> Any:
    file = descriptor_pb2.FileDescriptorProto(
        name="sparkplug_b.proto", package="org.eclipse.tahu.protobuf", syntax="proto2"
    )
    payload = file.message_type.add(name="Payload")
    metric = payload.nested_type.add(name="Metric")
    metric.oneof_decl.add(name="value")
    for name, (number, kind) in METRIC.items():
        field = metric.field.add(name=name, number=number, type=kind, label=F.LABEL_OPTIONAL)
        if number >= 10:
            field.oneof_index = 0
    payload.field.add(name="timestamp", number=1, type=F.TYPE_UINT64, label=F.LABEL_OPTIONAL)
    payload.field.add(
        name="metrics",
        number=2,
        type=F.TYPE_MESSAGE,
        label=F.LABEL_REPEATED,
        type_name=".org.eclipse.tahu.protobuf.Payload.Metric",
    )
    payload.field.add(name="seq", number=3, type=F.TYPE_UINT64, label=F.LABEL_OPTIONAL)
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("org.eclipse.tahu.protobuf.Payload"))


Payload: Any = _payload_class()


def decoded(data: bytes) -> Any:
    return Payload.FromString(data)


def values(data: bytes) -> dict[str, Any]:
    """Values by name; None for null."""
    return {
        metric.name: None if metric.is_null else getattr(metric, metric.WhichOneof("value"))
        for metric in decoded(data).metrics
    }
